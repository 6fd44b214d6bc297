# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The two elements of the paper: Table I."""

from __future__ import annotations

from .design import Design

CASE_I = Design(N=200, gamma=-2.5e-4, beta=-1 / 5, J=100, J_s=200, j_0=81.0, d=0.0061)
"""Table I, Case I: the element of the energy landscape, Fig. 2. One defect in its middle."""

CASE_II = Design(N=225, gamma=-4e-4 / 3, beta=-1 / 20, J=25, J_s=50, j_0=17.0, d=0.0380)
"""Table I, Case II: the eight-level memory, Figs. 3 to 5."""
