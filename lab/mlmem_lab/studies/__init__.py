# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many elements and many settings: campaigns, margins, tolerance, proofs of designs."""
