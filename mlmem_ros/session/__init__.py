# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a replay needs in a bag, written and read, and the replay itself. No file format here."""
