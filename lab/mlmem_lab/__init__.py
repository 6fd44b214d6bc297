# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The laboratory: studies around mlmem_ros, which it imports and which never imports it."""
