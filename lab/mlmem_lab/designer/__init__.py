# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From levels, scatter and friction to an element that kicks write.

`search` finds it, `studies.proof` simulates it.
"""
