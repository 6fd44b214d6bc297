# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One file per figure: `compute(quality)` returns its data, `draw(data)` its drawing."""
