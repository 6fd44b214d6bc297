# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ways to read an element: by delays, or by waveforms; echoes and calibration."""
