# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element that is read with one transducer, at its left end: what nobody notices.

python3 -m mlmem_lab.one_transducer [PRESET ...] makes lab/results/one_transducer.json. What the
right end does is hidden: its samples are those of a blank element. One cell sticks, or has three
times its stiffness, and a wall at rest at every level is read by the left end alone, and by both
as the device does.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace

import numpy as np

from mlmem import BLANK, End, MemoryElement, Read, factory_calibration, preset
from mlmem.instrument.blocks import run
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Specimen, StateError
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.potential import Array
from mlmem.physics.stepping import HeldCell
from mlmem.presets import use_kicks
from mlmem.readers.decoding import decode_echoes
from mlmem.readers.listening import probe_ends
from mlmem.readers.reading import UNDECODABLE

from .results import run as run_study

RANDOM_SEED = 1
BAD_CELL_SITES = 24
"""Bad cells that are tried, evenly over the element."""

STUDIED_PRESETS = 'kick_2', 'case_2'


class LeftAlone(Simulation):
    """An element whose right end has no transducer: it reads as if it had never moved."""

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        looks: int = 1,
    ) -> Array:
        """Advance the chain, and hide its right end."""
        ends = super().advance(V_N, held_cell, shake, looks)
        ends[1] = self.chain.design.D_s1
        return ends

    def end(self, site: int) -> float:
        """Return the displacement of an end, of the right one as if it never moved."""
        return super().end(1) if site == 1 else self.chain.design.D_s1


def build_element(name: str, made: Specimen | None = None) -> MemoryElement:
    """Return an element with one transducer."""
    design, settings = use_kicks(preset(name))
    settings = replace(settings, read=replace(settings.read, end='left'))
    driver = LeftAlone.of(made or Specimen(design), settings.time)
    return MemoryElement(design, settings, factory_calibration(design, settings), driver)


def read(element: MemoryElement) -> int:
    """Return what the left end alone says: a level, `BLANK` if it is inactive, `UNDECODABLE`."""
    if element.phase(End.LEFT) == 0:
        return BLANK
    echoes = run(element, probe_ends(element, (End.LEFT,)))
    read = element.settings.read
    return decode_echoes(element.design, read, element.calibration, echoes, (1, 0)).level


def count_reads(name: str) -> dict[str, dict[str, int]]:
    """Return how reads with one bad cell ended, by the left end alone and by both."""
    design, settings = use_kicks(preset(name))
    both = MemoryElement(design, settings, factory_calibration(design, settings))
    found = {each: Counter[str]() for each in ('left', 'both')}
    for site in np.linspace(2, design.N - 1, BAD_CELL_SITES).astype(int).tolist():
        for level in range(design.levels):
            factor = np.ones(design.N)
            factor[site - 1] = 3.0
            for made in (Specimen(design, stuck=(site,)), Specimen(design, alpha_factor=factor)):
                try:
                    v = find_pinned_wall(replace(made, stuck=()), level)
                except StateError:
                    continue
                alone = build_element(name, made)
                alone.chain.place(v)
                alone.transducer.assume_equilibrium()
                said = read(alone)
                found['left'].update(reads=1, **{_classify_read(said, level): 1})
                both = MemoryElement(design, settings, both.calibration,
                                     Simulation.of(made, settings.time))  # fmt: skip
                both.chain.place(v)
                both.transducer.assume_equilibrium()
                reading = both.perform(Read()).reading
                said = UNDECODABLE if reading is None else reading.level
                found['both'].update(reads=1, **{_classify_read(said, level): 1})
    return {end: dict(counts) for end, counts in found.items()}


def _classify_read(said: int, level: int) -> str:
    return 'right' if said == level else 'undecodable' if said == UNDECODABLE else 'wrong'


if __name__ == '__main__':
    sys.exit(
        run_study('one_transducer', __doc__, count_reads, RANDOM_SEED, entries=STUDIED_PRESETS)
    )
