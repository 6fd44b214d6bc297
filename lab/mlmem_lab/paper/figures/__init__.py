# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One file a figure: its data, drawing, title and claims. Named in `gallery`."""
