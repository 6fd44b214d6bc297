# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What it changes to stop an element that moves slower than a threshold: how `REST` was chosen.

.venv/bin/python lab/tools/rest_threshold.py case_2 bits_2

An element is written and never rests. As soon as no cell is faster, or accelerates faster, than a
threshold, two copies are read, one of them stopped before, and their echoes compared.
"""

import argparse
from typing import Any

import numpy as np

from mlmem_ros.device import (
    EchoReceived,
    MemoryElement,
    Read,
    Write,
    new_element,
    preset,
    snapshot,
)
from mlmem_ros.device.echo import FAINTEST
from mlmem_ros.physics.statics import metamaterial_force

THRESHOLDS = (1e-6, 1e-8, 1e-10, 1e-12, 1e-13)

LONGEST = 5000
"""Ticks after which an element does not come to rest."""


def restless(name: str) -> MemoryElement:
    """Return an element that computes every tick."""
    element = new_element(preset(name))
    chain = element.chain
    element.driver.rests = lambda V_N: False
    element.driver.advance = lambda V_N, held, shake, looks: chain.advance(V_N, held, shake)
    return element


def fastest(element: MemoryElement) -> float:
    """Return the greatest speed or acceleration of a cell."""
    chain = element.chain
    acceleration = metamaterial_force(chain.specimen, chain.v, chain.V) / chain.specimen.masses
    return float(max(np.abs(chain.velocity).max(), np.abs(acceleration).max()))


def copied(name: str, taken: dict[str, Any], *, stopped: bool) -> MemoryElement:
    """Return a copy of an element from its snapshot; if it is stopped, no cell moves."""
    element = restless(name)
    snapshot.restore(element, taken)
    if stopped:
        chain = element.chain
        state = chain.state()
        state[1:3] = 0.0
        chain.restore(state, V_N=chain.V_N, steps_done=chain.steps_done)
    return element


def read(element: MemoryElement) -> list[EchoReceived]:
    """Read an element; return what both ends hear."""
    heard: list[EchoReceived] = []
    element.apply(Read())
    while element.procedure:
        heard += [each for each in element.advance() if isinstance(each, EchoReceived)]
    return heard


def compared(name: str, level: int) -> list[str]:
    """Return a row for every threshold that is reached."""
    element, rows = restless(name), []
    element.perform(Write(level))
    written = element.ticks
    for threshold in THRESHOLDS:
        while fastest(element) >= threshold:
            element.advance()
            if element.ticks > written + LONGEST:
                return rows
        taken = snapshot.take(element)
        heard = (read(copied(name, taken, stopped=stopped)) for stopped in (False, True))
        pairs = list(zip(*heard, strict=True))
        loud = max(float(np.abs(a.echo.v_c - b.echo.v_c).max()) for a, b in pairs)
        delay = max(abs((a.echo.delay or 0.0) - (b.echo.delay or 0.0)) for a, b in pairs)
        rows.append(
            f'| `{name}` | {level} | {threshold:g} | {element.ticks - written} '
            f'| {loud / FAINTEST:.2g} | {delay:g} |'
        )
    return rows


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('presets', nargs='*', default=['case_2'], help='shipped elements')
    print(
        '| preset | level | threshold | ticks after the write | v_c, in least thresholds | delay |'
    )
    print('|---|---|---|---|---|---|')
    for name in parser.parse_args().presets:
        levels = preset(name).design.levels
        for level in sorted({0, levels // 2, levels - 1}):
            print('\n'.join(compared(name, level)), flush=True)


if __name__ == '__main__':
    main()
