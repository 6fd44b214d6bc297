# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element with one transducer, at its left end: what works, and what nobody notices.

python3 -m mlmem_lab.one_transducer [PRESET ...] makes lab/results/one_transducer.json. Random
levels are written any to any: pushed from the left, kicked, and read by the left end's echo alone.
What the right end does is hidden: its samples are those of a blank element. Then one cell sticks,
or has three times its stiffness, and a wall at rest at every level is read by the left end alone,
and by both as the device does.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

from mlmem import BLANK, End, MemoryElement, Read, factory_calibration, preset
from mlmem.instrument.drivers import Simulation
from mlmem.move_settings import PushSettings
from mlmem.physics import Specimen, StateError, level_of
from mlmem.physics.equilibrium import resting_wall
from mlmem.physics.potential import Array
from mlmem.physics.stepping import HeldCell
from mlmem.procedures.blocks import kick, push, run
from mlmem.procedures.listening import pulse_echo
from mlmem.procedures.writing import NUDGE
from mlmem.readers.decoding import decode
from mlmem.readers.reading import UNDECODABLE

from .results import run as run_study

SEED, WRITES, ATTEMPTS = 1, 1000, 3
SITES = 24
"""Bad cells that are tried, evenly over the element."""

PUSHES = {
    'kick_2': PushSettings('left', omega_c=1.6, A=0.9, sigma=6.0, settle=1600.0),
    'kick_3': PushSettings('left', omega_c=1.6, A=0.9, sigma=6.0, settle=1600.0, after=1.05),
}
"""From the left end, by preset."""


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


def element_of(name: str, made: Specimen | None = None) -> MemoryElement:
    """Return an element with one transducer."""
    design, settings = preset(name)
    settings = replace(settings, push=PUSHES[name], read=replace(settings.read, end='left'))
    driver = LeftAlone.of(made or Specimen(design), settings.time)
    return MemoryElement(design, settings, factory_calibration(design, settings), driver)


def read(element: MemoryElement) -> int:
    """Return what the left end alone says: a level, `BLANK` if it is inactive, `UNDECODABLE`."""
    if element.phase(End.LEFT) == 0:
        return BLANK
    echoes = run(element, pulse_echo(element, (End.LEFT,)))
    read = element.settings.read
    return decode(element.design, read, element.calibration, echoes, (1, 0)).level


def write(element: MemoryElement, level: int) -> tuple[bool, int]:
    """Write a level as the device does, but by the left end; return whether it was read, and how
    many attempts that took.
    """
    nudge = 1.0
    for attempt in range(1, ATTEMPTS + 1):
        force = nudge
        if element.phase(End.LEFT) != 0:
            pulses = element.settings.push.pulses
            if not any(run(element, push(element)) for _ in range(pulses)):
                return False, attempt
            force *= element.settings.push.after
        run(element, kick(element, level, force))
        if (found := read(element)) == level:
            return True, attempt
        if found >= 0:
            nudge *= NUDGE if found < level else 1.0 / NUDGE
    return False, ATTEMPTS


def counted(name: str) -> dict[str, Any]:
    """Return how random writes ended, and how reads of elements with one bad cell did."""
    element, rng = element_of(name), random.Random(SEED)
    levels = element.design.levels
    ended: Counter[str] = Counter(dict.fromkeys(('writes', 'failed', 'wrong', 'again'), 0))
    ticks, there = [], BLANK
    for _ in range(WRITES):
        wanted = rng.choice([level for level in range(levels) if level != there])
        begin = element.ticks
        said, attempts = write(element, wanted)
        ticks.append(element.ticks - begin)
        there = level_of(element.design, element.chain.configuration)
        ended.update(writes=1, failed=not said, again=attempts > 1, wrong=said and there != wanted)
    return {**ended, 'median': median(ticks), 'longest': max(ticks), 'bad cell': _bad_cells(name)}


def _bad_cells(name: str) -> dict[str, dict[str, int]]:
    """Return how reads with one bad cell ended, by the left end alone and by both."""
    design, settings = preset(name)
    both = MemoryElement(design, settings, factory_calibration(design, settings))
    found = {each: Counter[str]() for each in ('left', 'both')}
    for site in np.linspace(2, design.N - 1, SITES).astype(int).tolist():
        for level in range(design.levels):
            factor = np.ones(design.N)
            factor[site - 1] = 3.0
            for made in (Specimen(design, stuck=(site,)), Specimen(design, alpha_factor=factor)):
                try:
                    v = resting_wall(replace(made, stuck=()), level)
                except StateError:
                    continue
                alone = element_of(name, made)
                alone.chain.place(v)
                alone.transducer.assume_rest()
                said = read(alone)
                found['left'].update(reads=1, **{_kind(said, level): 1})
                both = MemoryElement(design, settings, both.calibration,
                                     Simulation.of(made, settings.time))  # fmt: skip
                both.chain.place(v)
                both.transducer.assume_rest()
                reading = both.perform(Read()).reading
                said = UNDECODABLE if reading is None else reading.level
                found['both'].update(reads=1, **{_kind(said, level): 1})
    return {end: dict(counts) for end, counts in found.items()}


def _kind(said: int, level: int) -> str:
    return 'right' if said == level else 'undecodable' if said == UNDECODABLE else 'wrong'


if __name__ == '__main__':
    sys.exit(run_study('one_transducer', __doc__, counted, SEED, entries=PUSHES))
