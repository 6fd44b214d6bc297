# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What goes wrong with a campaign."""


class CampaignError(Exception):
    """A campaign cannot be run or continued; the message says what to do."""
