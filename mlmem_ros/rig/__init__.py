# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A real element behind a serial line or TCP: the protocol, its driver, and an emulated rig.

`docs/reference/rig.md` has its rules.
"""

from .driver import Rig

__all__ = ['Rig']
