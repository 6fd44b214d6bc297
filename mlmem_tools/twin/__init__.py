# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An individual element as fitted to its echoes, and what it forecasts."""
