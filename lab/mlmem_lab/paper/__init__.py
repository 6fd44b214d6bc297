# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper reproduced: one file a figure, its claims, a second route to every number."""
