# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What fitted elements are worth, and a twin's warnings."""
