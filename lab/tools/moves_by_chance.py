# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How often steps up, strokes and throws fail in random elements, or on a shaking base.

    python lab/tools/moves_by_chance.py bits_4 alpha 0.002 0.004 0.008 --elements 100

In every random element each kind of move is tried once, from a random level. It succeeds if the
wall rests within a quarter of a level of its defect. The last row is the amount at which one in a
thousand fails, with its interval, as `mlmem tolerance` estimates it; it needs at least two amounts
at which some fail, but no more than a few per cent.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from mlmem_lab.studies.tolerance.estimate import Rate, rare_scatter
from mlmem_ros.checks.bare import REST
from mlmem_ros.device.moves import How, Move, cycle_of, moves_from
from mlmem_ros.device.presets import preset
from mlmem_ros.device.settings import Settings
from mlmem_ros.physics import (
    Chain,
    Design,
    Scatter,
    Specimen,
    StateError,
    level_of,
    scattered,
    stable_step,
    substep_times,
)
from mlmem_ros.physics.equilibrium import resting_wall

SHAKEN = 20.0
"""Time units between two random accelerations; it is linear between them."""


def kinds(design: Design, settings: Settings) -> dict[str, list[Move]]:
    """Return all moves of an element by kind."""
    found: dict[str, list[Move]] = {}
    for level in range(design.levels):
        for move in moves_from(design, settings, level):
            if move.how in (How.STEP, How.STROKE, How.THROW):
                name = move.how.value
                if move.how is How.STROKE:
                    way = 'up' if move.target > level else 'down'
                    name = f'{name} {way} from {"odd" if level % 2 else "even"}'
                found.setdefault(name, []).append(move)
    return found


def made(
    specimen: Specimen, settings: Settings, move: Move, shaken: float, chance: np.random.Generator
) -> bool:
    """Return whether a move takes the wall where it should."""
    design = specimen.design
    chain = Chain(design, min(0.9, 0.95 * stable_step(specimen)))
    chain.set_specimen(specimen)
    cycle = cycle_of(design, settings, move)
    steps, rest = round(cycle.duration / chain.dt), round(REST / chain.dt)
    times = substep_times(steps, chain.dt, chain.integrator)
    knots = np.arange(0.0, times[-1] + 2.0 * SHAKEN, SHAKEN)
    shake = np.interp(times, knots, shaken * chance.standard_normal(len(knots)))
    try:
        chain.place(resting_wall(specimen, move.start))
        V_N = cycle.strain(times) * design.end_displacement(1.0)
        chain.advance(V_N, shake=shake if shaken else None)
        chain.rest(rest)
    except StateError:
        return False
    return level_of(design, chain.configuration, design.J / 4) == move.target


def rows(name: str, kind: str, amounts: list[float], elements: int, seed: int) -> Iterator[str]:
    """Yield a line of a table for every amount of chance."""
    design, settings = preset(name)
    moves = kinds(design, settings)
    counts: dict[str, list[Rate]] = {which: [] for which in moves}
    yield f'| {kind} | ' + ' | '.join(moves) + ' |'
    for amount in amounts:
        failed = dict.fromkeys(moves, 0)
        for element in range(elements):
            chance = np.random.default_rng((seed, element))
            scatter = Scatter() if kind == 'vibration' else Scatter(**{kind: amount})
            specimen = scattered(design, scatter, seed + element)
            shaken = amount if kind == 'vibration' else 0.0
            for which, some in moves.items():
                move = some[chance.integers(len(some))]
                failed[which] += not made(specimen, settings, move, shaken, chance)
        for which, count in failed.items():
            counts[which].append(Rate(count, elements))
        yield f'| {amount:g} | {" | ".join(map(str, failed.values()))} | of {elements}'
    rare = [rare_scatter(amounts, rates) for rates in counts.values()]
    texts = ['-' if each is None else '{:.2g} ({:.2g} to {:.2g})'.format(*each) for each in rare]
    yield f'| 1 in 1000 | {" | ".join(texts)} |'


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('preset')
    parser.add_argument('kind', choices=('alpha', 's', 'mass', 'offset', 'vibration'))
    parser.add_argument('amounts', type=float, nargs='+')
    parser.add_argument('--elements', type=int, default=100)
    parser.add_argument('--seed', type=int, default=0)
    asked = parser.parse_args()
    for row in rows(asked.preset, asked.kind, asked.amounts, asked.elements, asked.seed):
        print(row, flush=True)


if __name__ == '__main__':
    main()
