# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a robot may read and write while it walks, over gait, ground, and the element's pace.

python3 -m mlmem_lab.walking [PRESET ...] makes lab/results/walking.json; it needs MuJoCo, and the
body of examples/walking_robot. The IMU of the walking body shakes an element through
`Disturb`, as messages on `~/disturbance` do. A slower element, of softer springs or heavier cells,
feels the same walk as a stronger shake: its unit of acceleration is smaller.
"""

from __future__ import annotations

import itertools
import runpy
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from mlmem import Disturb, MemoryElement, Read, Write, new_element, preset
from mlmem.physics.potential import Array

from .reads.count import true_level
from .results import CHECKOUT_ROOT, run

TIME_UNITS_S = (1e-4, 2e-4, 3e-4, 1e-3)
"""Seconds of a time unit; the first is the default of `scale.time`."""

STONE_HEIGHTS_M = (0.0, 0.02, 0.04)
"""Height of the stones in m; the body stands 0.14 m high."""

READS, WRITES = 5, 5
"""Of every case."""

WALK_TIME_S = 30.0
"""Of a walk, which begins anew when it is over."""

RANDOM_SEED = 1

BODY_FILE = 'examples/walking_robot/hexapod.py'


@cache
def load_body() -> dict[str, Any]:
    """Return what the file of the body defines."""
    return runpy.run_path(str(CHECKOUT_ROOT / BODY_FILE))


@cache
def walk_acceleration(gait: int, roughness: float) -> Array:
    """Return what the IMU feels along the chain in m/s^2, a sample a step of the body."""
    known = load_body()
    robot, felt = known['Hexapod'](roughness), []
    for _ in range(round(WALK_TIME_S / known['STEP'])):
        robot.step(known['GAITS'][gait])
        felt.append(robot.acceleration[0])
    return np.array(felt)


def make_element(name: str, pace: float) -> MemoryElement:
    """Return an element of a preset whose time unit takes so many seconds."""
    chosen = preset(name)
    scale = replace(chosen.settings.scale, time=pace)
    return new_element(chosen._replace(settings=replace(chosen.settings, scale=scale)))


def count_walk(name: str, pace: float, gait: int, roughness: float) -> dict[str, Any]:
    """Count reads, then writes, of an element on a walking robot."""
    felt, step = walk_acceleration(gait, roughness), load_body()['STEP']
    element = make_element(name, pace)
    unit, seconds = element.units.acceleration, element.settings.tick_seconds
    random = np.random.Generator(np.random.PCG64(RANDOM_SEED))
    first = element.ticks

    def apply_shaking() -> None:
        """Give the element the newest message, if one has come since the last tick."""
        now = (element.ticks - first) * seconds / step
        if now == 0.0 or int(now) > int(now - seconds / step):
            element.apply(Disturb(float(felt[int(now) % len(felt)]) / unit))

    found: Counter[str] = Counter()
    for _ in range(READS):  # of another content each, written while the robot stands
        level = int(random.integers(element.reader.content_count))
        element.apply(Disturb(0.0))
        element.perform(Write(level))
        apply_shaking()
        outcome = element.perform(Read(), apply_shaking)
        said = outcome.reading.level if outcome.success and outcome.reading else None
        there = true_level(element)
        found['lost'] += there != level
        found['read' if said == there else 'refused' if said is None else 'read wrong'] += 1
    for _ in range(WRITES):
        level = int(random.integers(element.reader.content_count))
        apply_shaking()
        outcome = element.perform(Write(level), apply_shaking)
        right = true_level(element) == level
        found['written' if right else 'written wrong'] += outcome.success
        found['not written'] += not outcome.success
    most = float(np.abs(felt).max())
    return {
        'gait': load_body()['GAITS'][gait].name, 'roughness': roughness, 'time unit': pace,
        'most': round(most, 1),
        'of harmless': round(most / unit / element.settings.disturbance.harmless, 3),
        **{key: found[key] for key in COUNTED_KINDS},
    }  # fmt: skip


COUNTED_KINDS = (
    'read',
    'refused',
    'read wrong',
    'lost',
    'written',
    'not written',
    'written wrong',
)


def count_preset(name: str) -> list[dict[str, Any]]:
    """Return the counts of a preset over all paces, gaits and grounds."""
    gaits = range(1, len(load_body()['GAITS']))
    return [
        count_walk(name, *case) for case in itertools.product(TIME_UNITS_S, gaits, STONE_HEIGHTS_M)
    ]


def merge_counts(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the counts of every preset, and their sums."""
    presets = kept.get('presets', {}) | {name: found}
    every = [row for rows in presets.values() for row in rows]
    return {
        'all': {key: sum(row[key] for row in every) for key in COUNTED_KINDS},
        'presets': presets,
    }


def draw_success(result: Mapping[str, Any]) -> Any:
    """Draw the share of reads and writes that succeed over the strongest shake of the walk."""
    from .studies.style import axes_grid, label_panel, new_figure

    figure = new_figure(2.9)
    axes = axes_grid(figure, 1, 2, sharey=True)[0]
    for each, letter, what, good, bad in (
        (axes[0], 'a', 'reads', 'read', 'refused'),
        (axes[1], 'b', 'writes', 'written', 'not written'),
    ):
        for number, (name, rows) in enumerate(result['presets'].items()):
            points = [(row['of harmless'], row[good] / (row[good] + row[bad])) for row in rows]
            each.semilogx(
                [x for x, _ in points], [100.0 * y + 1.5 * number for _, y in points],
                GAIT_MARKERS[number], color=GAIT_COLOURS[number], alpha=0.7, label=name,
            )  # fmt: skip
        each.axvline(1.0, ls='--', color='0.5')
        label_panel(each, letter, what)
        each.set_xlabel('strongest shake / disturbance.harmless')
    axes[0].set_ylabel('succeed (%)')
    axes[1].legend()
    return figure


GAIT_MARKERS = 'o^s'

GAIT_COLOURS = ('#0072b2', '#d55e00', '#009e73')

if __name__ == '__main__':
    presets = ('byte', 'case_2')
    modules = [BODY_FILE, 'lab/mlmem_lab/reads/count.py']
    sys.exit(
        run(
            'walking',
            __doc__,
            count_preset,
            RANDOM_SEED,
            merge_counts,
            presets,
            draw_success,
            modules,
        )
    )
