# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chains of other laws than a memory's, one per file, stepped by the same two loops."""

from .lattice import Lattice
from .law import Coupling, Friction, OnSite
from .linear import Linear
from .phi4 import Phi4
from .pieces import Pieces
from .power_law import PowerLaw
from .toda import Toda
from .wells import Wells

__all__ = [
    'Coupling', 'Friction', 'Lattice', 'Linear', 'OnSite', 'Phi4', 'Pieces', 'PowerLaw', 'Toda',
    'Wells',
]  # fmt: skip
