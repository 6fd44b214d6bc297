# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element in a browser's tab: the product's loop as WebAssembly, and what its presets do."""
