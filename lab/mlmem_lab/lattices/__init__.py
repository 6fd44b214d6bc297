# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Chains of other laws than a memory's, stepped by the same two loops."""

from .couplings import Linear, PowerLaw, Toda
from .lattice import Coupling, Lattice, OnSite
from .on_site import Phi4

__all__ = ['Coupling', 'Lattice', 'Linear', 'OnSite', 'Phi4', 'PowerLaw', 'Toda']
