# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pages of docs/reference that `scripts/reference.py` writes, by subject."""
