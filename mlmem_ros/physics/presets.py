# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The designs that ship: Table I of the paper, and elements of 1 to 8 bits."""

from __future__ import annotations

from .design import Design
from .errors import DesignError

CASE_I = Design(N=200, gamma=-2.5e-4, beta=-1 / 5, J=100, J_s=200, j_0=81.0, d=0.0061)
"""Table I, Case I: the element of the energy landscape, Fig. 2. One defect in its middle."""

CASE_II = Design(N=225, gamma=-4e-4 / 3, beta=-1 / 20, J=25, J_s=50, j_0=17.0, d=0.0380)
"""Table I, Case II: the eight-level memory, Figs. 3 to 5."""


def _designed(N: int, tail: int, eta: float = 1 / 250) -> Design:
    """Return what `studies.designer` found: Case II's cells, nine to a level."""
    return Design(
        N=N, gamma=-3e-5, beta=-1 / 20, J=9, J_s=18, j_0=6.84, d=0.0380, eta=eta, tail=tail
    )


PRESETS = {
    'case_1': CASE_I,
    'case_2': CASE_II,
    'bits_1': _designed(N=81, tail=54),
    'bits_2': _designed(N=99, tail=54),
    'bits_3': CASE_II,
    'bits_4': _designed(N=207, tail=54),
    'bits_5': _designed(N=369, tail=72),
    'bits_6': _designed(N=666, tail=81),
    'bits_8': _designed(N=2475, tail=162, eta=1 / 500),
}
"""Designs by name; `bits_n` stores n bits."""


def preset(name: str) -> Design:
    """Return a shipped design.

    Args:
        name: A key of `PRESETS`.

    Raises:
        DesignError: There is no such preset.
    """
    try:
        return PRESETS[name]
    except KeyError:
        raise DesignError(f'preset must be one of {", ".join(PRESETS)}; got {name!r}') from None
