# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far kicks may be off before the wall ends elsewhere."""
