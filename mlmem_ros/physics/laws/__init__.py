# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a chain is made of: laws of on-site energy, coupling and friction.

A law is a value. It knows its energy, force and stiffness for arrays, and the scalar formula of
its force, which is written into the loops before they are compiled.
"""

from .law import Coupling, Friction, OnSite
from .linear import Linear
from .multistable import Multistable

__all__ = ['Coupling', 'Friction', 'Linear', 'Multistable', 'OnSite']
