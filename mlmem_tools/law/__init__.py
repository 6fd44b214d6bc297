# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From measured force curves to the on-site law of a design."""
