# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a law, a coupling and a tracked film to what slows a chain, and to its other waves."""
