# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Health on /diagnostics, once a second: one status per component, one file each."""

from .reporter import Diagnostics

__all__ = ['Diagnostics']
