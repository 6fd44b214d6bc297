# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem kicks`: map kicks and pushes, and count writes without strain.

A kick of every speed starts from a blank element at rest, a push of every amplitude from every
level, on a bare chain as the device steps it. The window of a level is the range of speeds that
lead to it; its room is the least relative change of the speed that leaves it. Then random levels
are written to the device, any to any, and the true wall is compared with each answer.
"""

from __future__ import annotations

import argparse
import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from mlmem_ros.device import Erase, Write, new_element, preset
from mlmem_ros.device.driver import Simulation
from mlmem_ros.device.end import BoundaryMotion, Kick, Pulse
from mlmem_ros.device.reading import BLANK, UNDECODABLE
from mlmem_ros.device.settings import KickSettings
from mlmem_ros.physics import Chain, HeldCell, Scatter, StateError, level_of, substep_times
from mlmem_ros.physics.energy import energy
from mlmem_ros.physics.equilibrium import blank, resting_wall
from mlmem_ros.physics.specimen import Specimen, scattered
from mlmem_tools.cli.command import JSON, command, option
from mlmem_tools.cli.output import complain, plain_console, plain_table, print_json

from ..results import by, keep_picture, load, load_kept, save
from ..studies import style
from ..studies.bench import nearness
from ..studies.campaign.terminal import mapped

KICKED = ('kick_2', 'kick_3', 'kick_4')
"""The presets that are written without strain."""

SPEEDS = np.geomspace(0.002, 1.2, 321)
"""Mean speeds of kicks: 2 % apart."""

FINE = 5e-4
"""Relative error of the edge of a window."""

AMPLITUDES = np.round(np.arange(0.2, 1.001, 0.02), 2)
"""Amplitudes of pushes."""

SCATTERS = (3e-4, 1e-3, 3e-3)
"""Standard deviations of alpha, in every cell."""

DAMPING_TIMES = 10.0
"""Of rest after a motion."""

ERASES = 10
"""Every so many procedures is an erase."""


@command(
    'map kicks and pushes, and count writes without strain',
    option('presets', nargs='*', metavar='PRESET', help=f'none: {", ".join(KICKED)}'),
    option('--writes', type=int, default=1000, help='random procedures of each preset'),
    option('--elements', type=int, default=10, help='scattered elements for every disorder'),
    option('--seed', type=int, default=0, help='of all random numbers'),
    option('--workers', type=int, default=1, help='processes'),
    option('--output', type=Path, help='result file'),
    option('--figure', type=Path, metavar='PNG', help='draw the result file here'),
    JSON,
    text=__doc__,
)
def kicks(arguments: argparse.Namespace) -> int:
    """Measure; return 0, 1 if a write went wrong or a file was not written, 2 if misused."""
    if arguments.figure is not None:
        if arguments.output is None or not arguments.output.exists():
            return complain('kicks', '--figure needs the result file that --output names', 2)
        draw(load(arguments.output)['presets'], arguments.figure)
        made = f'mlmem kicks --output {arguments.output} --figure {arguments.figure}'
        keep_picture(arguments.figure, made, [*by(draw, 'picture'), 'lab/results/kicks.json'])
        return 0
    names = arguments.presets or list(KICKED)
    if strained := [name for name in names if not preset(name).settings.kick.by_level]:
        return complain('kicks', f'{strained[0]} has no kicks', 2)
    console = plain_console(aside=arguments.json)
    measure = partial(
        measured, writes=arguments.writes, elements=arguments.elements, seed=arguments.seed
    )
    done = mapped(console, arguments.workers, 'presets', measure, names)
    found = dict(zip(names, done, strict=True))
    table = plain_table(
        'Without strain', 'preset', '>least room', '>writes', '>wrong', '>failed', '>again',
        '>median', '>erase',
    )  # fmt: skip
    for name, each in found.items():
        told = each['written']
        table.add_row(
            name, f'{min(level["room"] for level in each["levels"]):.2f}',
            *(str(told[key]) for key in ('writes', 'wrong', 'failed', 'again', 'median', 'erase')),
        )  # fmt: skip
    console.print(table)
    if arguments.output is not None:
        try:
            kept = load_kept(arguments.output)
            every = {'presets': kept.get('presets', {}) | found}
            made = f'mlmem kicks {" ".join(every["presets"])} --writes {arguments.writes}'
            of = [*names, *by(measured, *names)]
            save(arguments.output, every, made, arguments.seed, of, kept)
        except (OSError, ValueError) as error:
            return complain('kicks', f'the result could not be written; {error}', 1)
    if arguments.json:
        print_json(found)
    wrong = sum(each['written'][key] for each in found.values() for key in ('wrong', 'failed'))
    return int(wrong > 0)


def measured(name: str, *, writes: int, elements: int, seed: int) -> dict[str, Any]:
    """Return the maps of a preset, and the count of its writes."""
    design, settings = preset(name)
    chain = Simulation.of(design, settings.time).chain
    ends = [after_kick(chain, float(u), settings.kick) for u in SPEEDS]
    levels = [_window(chain, name, level, ends) for level in range(design.levels)]
    return {
        'speeds': SPEEDS.round(5),
        'ends': ends,
        'levels': levels,
        'push': {
            'amplitudes': AMPLITUDES,
            'ends': [
                [after_push(chain, level, float(A), name) for A in AMPLITUDES]
                for level in range(design.levels)
            ],
        },
        'astray': [
            {'alpha': alpha, 'kicks': elements * design.levels}
            | {'astray': _astray(name, alpha, elements, seed)}
            for alpha in SCATTERS
        ],
        'written': count(name, writes, seed),
    }


def _window(chain: Chain, name: str, level: int, ends: Sequence[int]) -> dict[str, Any]:
    """Return the kick of a level as shipped: its range of speeds, its room and its energy."""
    shape = preset(name).settings.kick
    speed = shape.by_level[level]
    low, high = (_edge(chain, shape, level, ends, way) for way in (-1, 1))
    shapes = [replace(shape, hold=hold) for hold in (0.0, 10.0, 40.0, 100.0)]
    return {
        'level': level, 'speed': speed, 'low': round(low, 5), 'high': round(high, 5),
        'room': round(min(speed / low, high / speed) - 1.0, 3),
        'holds': [after_kick(chain, speed, each) for each in shapes],
        'energy': round(_stored(chain, speed, shape), 3), 'peak_speed': shape.fastest * speed,
    }  # fmt: skip


def _edge(chain: Chain, shape: KickSettings, level: int, ends: Sequence[int], way: int) -> float:
    """Return how far the speed of a level may change to one side, by bisection to `FINE`."""
    inside = shape.by_level[level]
    first = int(SPEEDS.searchsorted(inside, 'right' if way > 0 else 'left')) - (way < 0)
    beyond = range(first, len(SPEEDS) if way > 0 else -1, way)
    outside = next((float(SPEEDS[k]) for k in beyond if ends[k] != level), 0.0)
    if not outside:
        return float(SPEEDS[0 if way < 0 else -1])
    while abs(outside / inside - 1.0) > FINE:
        middle = math.sqrt(inside * outside)
        if after_kick(chain, middle, shape) == level:
            inside = middle
        else:
            outside = middle
    return inside


def drive(chain: Chain, site: int, motion: BoundaryMotion, rest: float) -> int:
    """Drive an end of an unstrained chain, let it rest, and return the level where the wall is."""
    steps = math.ceil((motion.duration + rest) / chain.dt)
    times = substep_times(steps, chain.dt, chain.integrator)
    held = HeldCell(site, motion.at(times[times <= motion.duration]))
    try:
        chain.advance(np.zeros(steps * chain.integrator.substeps), held)
    except StateError:  # driven so hard that the chain diverges
        return UNDECODABLE
    return level_of(chain.design, chain.configuration, nearness(chain.specimen))


def after_kick(chain: Chain, speed: float, shape: KickSettings) -> int:
    """Return where a kick leaves the wall: a level, `BLANK`, or `UNDECODABLE` for elsewhere."""
    chain.place(blank(chain.specimen))
    motion = Kick(chain.end(1), chain.design.D_s2, speed, shape)
    return drive(chain, 1, motion, DAMPING_TIMES / chain.design.eta)


def after_push(chain: Chain, level: int, amplitude: float, name: str) -> int:
    """Return where a push leaves the wall of a level."""
    push = replace(preset(name).settings.push, A=amplitude)
    chain.place(resting_wall(chain.specimen, level))
    site = 1 if push.end == 'left' else chain.design.N
    return drive(chain, site, Pulse(chain.end(site), push), DAMPING_TIMES / chain.design.eta)


def _stored(chain: Chain, speed: float, shape: KickSettings) -> float:
    """Return the energy that a kick leaves in the chain when the end is released."""
    chain.place(blank(chain.specimen))
    before = energy(chain).total
    drive(chain, 1, Kick(chain.end(1), chain.design.D_s2, speed, shape), 0.0)
    return energy(chain).total - before


def _astray(name: str, alpha: float, elements: int, seed: int) -> int:
    """Return how many kicks of scattered elements end elsewhere."""
    design, settings = preset(name)
    astray = 0
    for k in range(elements):
        made: Specimen = scattered(design, Scatter(alpha=alpha), seed + k)
        chain = Simulation.of(made, settings.time).chain
        for level, speed in enumerate(settings.kick.by_level):
            astray += after_kick(chain, speed, settings.kick) != level
    return astray


def count(name: str, procedures: int, seed: int) -> dict[str, Any]:
    """Write random levels, any to any, with an erase now and then; compare with the true wall."""
    element, chance = new_element(preset(name)), random.Random(seed)
    levels = range(element.design.levels)
    near = nearness(element.chain.specimen)
    present = BLANK
    ticks: list[int] = []
    erased: list[int] = []
    wrong = failed = again = strained = 0
    for k in range(1, procedures + 1):
        before = element.actuator.motion
        if k % ERASES:
            wanted = chance.choice([level for level in levels if level != present])
            outcome = element.perform(Write(wanted))
        else:
            wanted, outcome = BLANK, element.perform(Erase())
        (ticks if wanted != BLANK else erased).append(outcome.end_tick - outcome.start_tick)
        present = level_of(element.design, element.chain.configuration, near)
        failed += not outcome.success
        wrong += outcome.success and present != wanted
        again += outcome.attempts > 1
        strained += element.actuator.motion is not before
    return {
        'writes': len(ticks), 'erases': len(erased), 'wrong': wrong, 'failed': failed,
        'again': again, 'strained': strained, 'median': median(ticks),
        'ninth': sorted(ticks)[len(ticks) * 9 // 10], 'longest': max(ticks),
        'erase': median(erased), 'tick': element.tick,
    }  # fmt: skip


def draw(presets: Mapping[str, Any], picture: Path) -> None:
    """Draw the maps: the level over the speed of a kick, and over the amplitude of a push."""
    with style.styled():
        figure = style.new_figure(3.4)
        left, right = style.axes_grid(figure, 1, 2, width_ratios=(1.5, 1.0))[0]
        for name, found in presets.items():
            speeds, ends = np.array(found['speeds']), np.array(found['ends'])
            some = ends >= 0
            left.plot(speeds[some], ends[some], '.', markersize=3, label=name)
            shipped = [(level['speed'], level['level']) for level in found['levels']]
            left.plot(*zip(*shipped, strict=True), 'k|', markersize=7)
            top = np.array(found['push']['ends'][-1])
            kept = top > UNDECODABLE
            amplitudes = np.array(found['push']['amplitudes'])
            right.plot(amplitudes[kept], top[kept], '.-', markersize=3, linewidth=0.5, label=name)
        left.set(
            xscale='log', xlabel='mean speed of the kick, cells per time unit', ylabel='level'
        )
        right.set(xlabel='amplitude of the push, cells', ylabel='level; -1: blank')
        left.legend()
        style.label(left, 'a', 'kicked from blank')
        style.label(right, 'b', 'pushed from the last level')
        figure.savefig(picture, metadata={'Software': None})
