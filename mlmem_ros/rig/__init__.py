# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A real element behind a serial line or TCP: its frames, its driver, and one that is emulated."""

from .driver import Rig

__all__ = ['Rig']
