# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: what a wall reflects of a carrier, and how many walls an element holds."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from mlmem.physics import Specimen
from mlmem.physics.potential import Array
from mlmem.physics.waves import (
    carry_rows,
    linearize_cells,
    pass_band,
    passing_tensions,
    reflection_ratio,
)
from mlmem.presets import preset
from mlmem.readers.register import pin_walls
from mlmem.readers.words import Code

from ...studies import style
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'walls', 'What a wall reflects, and how many an element holds', seconds=10,
)  # fmt: skip

DRAWN_LEVEL = 3
"""Of the wall of the paper's element that is drawn."""

CELLS_AROUND_WALL = 20
"""Cells on either side of it; the next defect is 25 away."""

WAVE_DECAY = 1e-7
"""Of the waves in time, which tells those that go on from those that come back."""

WRITING_METHODS = {
    'one wall, 25 cells a level': (25, None),
    'one wall, 9': (9, None),
    'any level, 25 (kicks)': (25, 1),
    'every second level, 9 (at rest)': (9, 2),
}
"""Cells a level, and least distance in levels, by what is written."""

SHIPPED_PRESETS = ('case_2', 'byte', 'register_4', 'register_5')

MAX_CELLS = 1500
"""Longest element, in cells."""


def compute_reflectivity(made: Specimen, v: Array, omega: Array, first: int, last: int) -> Array:
    """Return which share of the amplitude of a wave from the left comes back from cells, shape
    (F,), in an element at rest in displacements v.

    Args:
        omega: Frequencies inside the pass bands of both sides, shape (F,).
        first: Site of the first of these cells; those left of it are taken to be like it.
        last: Site of the last; the same.
    """
    stiffness, mass, spring = linearize_cells(made, v)
    square = np.asarray(-((omega - 1j * WAVE_DECAY) ** 2), dtype=np.complex128)
    loss, part = np.zeros_like(square), slice(first - 1, last)
    left, right = (stiffness[site - 1] + square for site in (first, last))
    beyond = np.stack((-passing_tensions(right)[0], np.ones_like(square)))[None]
    p, q = carry_rows(beyond, stiffness[None, part], mass[part], spring[part], square, loss)[0]
    return np.abs(reflection_ratio(-p / q, passing_tensions(left)))


@FIGURE.data
def compute_data(quality: Quality) -> Data:
    """Find what a wall and a kink of the byte reflect, and count words by length.

    Returns:
        `omega` and `wall`, `kink`: amplitude that comes back; `pulse`: carrier of the byte and
        half of its band; `linearize_cells`, and `bits` (way x length), shown where an element has
        a level; `shipped` (preset x cells, bits).
    """
    design, settings = preset('byte')
    made = Specimen(dataclasses.replace(design, eta=0.0))
    edges = [pass_band(stiffness) for stiffness in (design.k_s1, design.k_s2)]
    omega = np.linspace(max(low for low, _ in edges) + 0.01, min(high for _, high in edges) - 0.01,
                        quality.pick(50, 500))  # fmt: skip
    site = design.defect_site(DRAWN_LEVEL)
    wall = pin_walls(made, [DRAWN_LEVEL])
    kink = pin_walls(made, [DRAWN_LEVEL, design.levels - 1])
    lengths = np.unique(np.geomspace(50, MAX_CELLS, quality.pick(20, 100)).astype(int))
    probe = settings.register.probe
    return {
        'omega': omega,
        'wall': compute_reflectivity(
            made, wall, omega, site - CELLS_AROUND_WALL, site + CELLS_AROUND_WALL
        ),
        'kink': compute_reflectivity(
            made, kink, omega, site - CELLS_AROUND_WALL, site + CELLS_AROUND_WALL
        ),
        'pulse': [probe.omega_c, 2.0 / probe.sigma],
        'cells': lengths,
        'bits': [
            [_element_bits(int(n), *way) for n in lengths] for way in WRITING_METHODS.values()
        ],
        'shipped': [_shipped_capacity(name) for name in SHIPPED_PRESETS],
    }


def _element_bits(N: int, J: int, distance: int | None) -> float:
    """Return the bits of an element of so many cells, with a level every J."""
    levels = max(1, N // J - 1)
    if distance is None:
        return math.log2(levels + 1)
    return math.log2(Code(levels, distance).words)


def _shipped_capacity(name: str) -> tuple[float, float]:
    design, settings = preset(name)
    spacing = settings.register.spacing
    words = Code(design.levels, spacing).words if spacing else design.levels
    return float(design.N), math.log2(words)


@FIGURE.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw both."""
    figure = style.new_figure(3.6)
    mirror, room = style.axes_grid(figure, 1, 2)[0]
    mirror.semilogy(data['omega'], data['wall'], color=style.ACTIVE_COLOUR, label='wall')
    mirror.semilogy(
        data['omega'], data['kink'], color=style.INACTIVE_COLOUR, ls='--', label='kink'
    )
    carrier, half = data['pulse']
    mirror.axvspan(carrier - half, carrier + half, color=style.MARK_COLOUR, alpha=0.25, lw=0.0)
    mirror.axvline(carrier, color=style.MARK_COLOUR, ls='--')
    mirror.set(xlabel=r'carrier $\omega_c$', ylabel='amplitude that comes back', ylim=(1e-3, 1.0))
    mirror.legend(loc='upper center')
    style.label_panel(mirror, 'a', 'a wall at level 3 as a mirror')
    colors = (style.FAINT_COLOUR, style.FAINT_COLOUR, style.INK_COLOUR, style.INACTIVE_COLOUR)
    for (name, (J, *_)), bits, color in zip(
        WRITING_METHODS.items(), data['bits'], colors, strict=True
    ):
        dashed = '--' if J == 9 and color == style.FAINT_COLOUR else '-'
        room.loglog(data['cells'], bits, color=color, ls=dashed, label=name)
    for name, (N, bits) in zip(SHIPPED_PRESETS, data['shipped'], strict=True):
        room.plot(N, bits, 'o', color=style.MARK_COLOUR, ms=4)
        left = name == 'register_4'
        style.annotate_place(
            room, name, (N, bits), (-6, 3) if left else (6, -9), ha='right' if left else 'left'
        )
    room.set(xlabel='cells', ylabel='bits', ylim=(0.8, 2e3))
    room.legend(loc='upper left', fontsize='x-small')
    style.label_panel(room, 'b', 'capacity')
    return figure
