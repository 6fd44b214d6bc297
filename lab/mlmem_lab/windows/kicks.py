# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem kicks`: map kicks, how exact they must be, and count writes without strain.

Every kick starts from a blank element at rest, one that erases from a level, on a bare chain as
the device steps it. Maps show where they end, over their speed, shape, hold, overshoot and pause.
For each that ships, every quantity is off until it fails; elements that are not as designed, that
ring or that are shaken are tried; and a particle with the energy that the kick puts in says where
it should stop. Then random levels are written to the device, any to any, and the true wall is
compared with each answer.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from mlmem import Erase, Write, new_element, preset
from mlmem.physics import Specimen, find_level
from mlmem.presets import use_kicks
from mlmem.readers.reading import BLANK
from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..landscapes import KickedWall, band_edges, lowest_modes
from ..results import DEVICE_MODULES, keep_picture, load_kept, load_result, save_result
from ..studies import style
from ..studies.bench import arrival_tolerance
from ..studies.campaign.terminal import map_calls
from .flight import KICK_SPEEDS, after_kick, build_chain, erase_margins, kick_margins, speed_edge
from .maps import compute_maps, count_astray, parse_levels, stored_energy

KICKED_PRESETS = ('kick_2', 'case_2', 'kick_4')
"""The presets that are written without strain here."""

PROCEDURES_PER_ERASE = 10
"""Every so many procedures is an erase."""

PART_ENTRIES = {'kicks': 'levels', 'erases': 'erases', 'maps': 'maps', 'astray': 'astray',
         'written': 'written'}  # fmt: skip
"""Parts of a measurement, and an entry of each."""


@declare_command(
    'map kicks, how exact they must be, and count writes without strain',
    declare_option('presets', nargs='*', metavar='PRESET',
        help=f'none: {", ".join(KICKED_PRESETS)}'),
    declare_option('--writes', type=int, default=1000, help='random procedures of each preset'),
    declare_option('--elements', type=int, default=10,
        help='scattered elements for every disorder'),
    declare_option('--seed', type=int, default=0, help='of all random numbers'),
    declare_option('--parts', nargs='+', choices=PART_ENTRIES, default=[*PART_ENTRIES],
        help='to measure; others are as '
           'the result file has them'),
    declare_option('--workers', type=int, default=1, help='processes'),
    declare_option('--output', type=Path, help='result file'),
    declare_option('--figure', type=Path, metavar='PNG',
        help='draw what the result file has: the maps of '
           'the one preset that is named, or all presets beside each other; no more'),
    JSON_OPTION,
    text=__doc__,
)  # fmt: skip
def kicks(arguments: argparse.Namespace) -> int:
    """Measure; return 0, 1 if a write went wrong or a file was not written, 2 if misused."""
    names = arguments.presets or list(KICKED_PRESETS)
    if strained := [name for name in names if not preset(name).settings.kick.wall_speeds]:
        return print_failure('kicks', f'{strained[0]} has no kicks', 2)
    if arguments.figure is not None:
        return _draw_figure(arguments)
    try:
        kept = load_kept(arguments.output) if arguments.output is not None else {}
    except (OSError, ValueError) as error:
        return print_failure('kicks', f'--output could not be read; {error}', 2)
    known = kept.get('presets', {})
    for name in names:
        parts = [each for each in PART_ENTRIES if each not in arguments.parts]
        if missing := [each for each in parts if PART_ENTRIES[each] not in known.get(name, {})]:
            return print_failure(
                'kicks', f'--parts must name {missing[0]}: no file has it of {name}', 2
            )
    console = create_console(aside=arguments.json)
    measure = partial(
        measure_kicks,
        parts=arguments.parts,
        writes=arguments.writes,
        elements=arguments.elements,
        seed=arguments.seed,
    )
    done = map_calls(console, arguments.workers, 'presets', measure, names)
    found = {name: known.get(name, {}) | new for name, new in zip(names, done, strict=True)}
    table = create_table(
        'Without strain', 'preset', '>least room', '>stroke', '>erase speed', '>writes', '>wrong',
        '>failed', '>again', '>median', '>erase',
    )  # fmt: skip
    for name, each in found.items():
        told = each['written']
        least = [
            _least_value(each['levels'], 'room'),
            _least_value(each['levels'], 'rooms', 'gain'),
        ]
        least.append(_least_value(each['erases'], 'speed'))
        table.add_row(
            name, *(f'{room:.3f}' for room in least),
            *(str(told[key]) for key in ('writes', 'wrong', 'failed', 'again', 'median', 'erase')),
        )  # fmt: skip
    console.print(table)
    if arguments.output is not None:
        try:
            every = {'presets': known | found}
            made = f'mlmem kicks {" ".join(every["presets"])} --writes {arguments.writes}'
            modules = [*DEVICE_MODULES, 'lab/mlmem_lab/windows']
            save_result(arguments.output, every, made, modules, names, arguments.seed, kept)
        except (OSError, ValueError) as error:
            return print_failure('kicks', f'the result could not be written; {error}', 1)
    if arguments.json:
        print_json(found)
    wrong = sum(each['written'][key] for each in found.values() for key in ('wrong', 'failed'))
    return int(wrong > 0)


def _least_value(levels: list[dict[str, Any]], *keys: str) -> float:
    """Return the least value that the levels have at a key."""
    found: list[Any] = levels
    for key in keys:
        found = [each[key] for each in found]
    return min(map(float, found))


def _draw_figure(arguments: argparse.Namespace) -> int:
    """Draw a result file."""
    path, picture, names = arguments.output, arguments.figure, arguments.presets
    if path is None or not path.exists():
        return print_failure('kicks', '--figure needs the result file that --output names', 2)
    results = load_result(path)['presets']
    if missing := [name for name in names if name not in results]:
        return print_failure('kicks', f'{path} has no {missing[0]}: measure it first', 2)
    if names:
        draw_maps(names[0], results[names[0]], picture)
    else:
        draw_kicks(results, picture)
    told = ' '.join(['mlmem kicks', *names[:1], f'--output {path} --figure {picture}'])
    keep_picture(picture, told, ['lab/mlmem_lab/windows/kicks.py', f'{path}'])
    return 0


def measure_kicks(
    name: str, parts: Sequence[str], *, writes: int, elements: int, seed: int
) -> dict[str, Any]:
    """Return parts of what is known of a preset: its kicks with their rooms, the rooms of the
    one that erases, maps of both, what becomes of them on elements that are not as designed, and
    the count of its writes.
    """
    of_part: dict[str, Callable[[], dict[str, Any]]] = {
        'kicks': lambda: _measure_kicks(name),
        'erases': lambda: {'erases': _measure_erases(name)},
        'maps': lambda: {'maps': compute_maps(name)},
        'astray': lambda: {'astray': count_astray(name, elements, seed)},
        'written': lambda: {'written': count(name, writes, seed)},
    }
    found: dict[str, Any] = {}
    for part in parts:
        found |= of_part[part]()
    return found


def _measure_kicks(name: str) -> dict[str, Any]:
    """Return where kicks of a preset end, the rooms of those it uses, and what energy predicts."""
    design, settings = preset(name)
    made = Specimen(design)
    chain, wall = build_chain(made, settings), KickedWall.of(made)
    shape = settings.kick
    ends = np.array([after_kick(chain, float(u), shape) for u in KICK_SPEEDS])
    levels = []
    for level, speed in enumerate(shape.wall_speeds):
        at = int(np.argmin(np.abs(KICK_SPEEDS - speed)))
        low, high = (
            speed_edge(chain, shape, level, KICK_SPEEDS, ends, at, way) for way in (-1, 1)
        )
        energy, start = stored_energy(chain, speed, shape)
        levels.append({
            'level': level, 'speed': speed, 'low': round(low, 5), 'high': round(high, 5),
            'room': round(min(speed / low, high / speed) - 1.0, 3),
            'rooms': kick_margins(chain, level, shape),
            'energy': round(energy, 3), 'predicted': wall.level(energy, start),
            'peak_speed': shape.peak_speed_ratio * speed,
        })  # fmt: skip
    return {
        'speeds': KICK_SPEEDS.round(5),
        'ends': ends,
        'levels': levels,
        'predicted': sum(each['predicted'] == each['level'] for each in levels),
        'modes': [lowest_modes(made, level, 2).round(4) for level in range(design.levels)],
        'band edges': np.round(band_edges(made), 4),
    }


def _measure_erases(name: str) -> list[dict[str, float]]:
    """Return the rooms of the kick that erases, at every level of a preset."""
    design, settings = preset(name)
    chain = build_chain(Specimen(design), settings)
    return [erase_margins(chain, level, settings.kick) for level in range(design.levels)]


def count(name: str, procedures: int, seed: int) -> dict[str, Any]:
    """Write random levels, any to any, with an erase now and then; compare with the true wall."""
    element, rng = new_element(use_kicks(preset(name))), random.Random(seed)
    levels = range(element.design.levels)
    near = arrival_tolerance(element.chain.specimen)
    present = BLANK
    ticks: list[int] = []
    erased: list[int] = []
    wrong = failed = again = strained = 0
    for k in range(1, procedures + 1):
        before = element.actuator.motion
        if k % PROCEDURES_PER_ERASE:
            wanted = rng.choice([level for level in levels if level != present])
            outcome = element.perform(Write(wanted))
        else:
            wanted, outcome = BLANK, element.perform(Erase())
        (ticks if wanted != BLANK else erased).append(outcome.end_tick - outcome.start_tick)
        present = find_level(element.design, element.chain.configuration, near)
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


def draw_kicks(presets: Mapping[str, Any], picture: Path) -> None:
    """Draw the level over the speed of a kick, with what energy alone says, and the share of
    levels that a kick erases over its speed.
    """
    with style.style_context():
        figure = style.new_figure(3.4)
        left, right = style.axes_grid(figure, 1, 2, width_ratios=(1.5, 1.0))[0]
        for name, found in presets.items():
            speeds, ends = np.array(found['speeds']), np.array(found['ends'])
            some = ends >= 0
            (points,) = left.plot(speeds[some], ends[some], '.', markersize=3, label=name)
            shipped = [(each['speed'], each['level']) for each in found['levels']]
            left.plot(*zip(*shipped, strict=True), 'k|', markersize=7)
            energy = [(each['speed'], each['predicted']) for each in found['levels']]
            left.plot(*zip(*energy, strict=True), 'o', mfc='none', ms=6, color=points.get_color())
            erase = found['maps']['erase']
            share = 100.0 * (parse_levels(erase['rows']) == BLANK).mean(axis=0)
            right.plot(erase['xs'], share, '.-', markersize=3, linewidth=0.5, label=name)
        left.set(
            xscale='log', xlabel='mean speed of the kick, cells per time unit', ylabel='level'
        )
        right.set(xscale='log', xlabel='mean speed of the kick', ylabel='levels erased, %')
        left.legend()
        style.label_panel(left, 'a', 'kicked from blank')
        style.label_panel(right, 'b', 'kicked out')
        figure.savefig(picture, metadata={'Software': None})


SHOWN_MAPS = {
    'ramp': 'how late it is fastest', 'hold': 'hold', 'overshoot': 'overshoot, cells',
    'two parts': 'pause half-way', 'erase': 'erased: level',
}  # fmt: skip
"""The maps in their order, with the names of their vertical axes."""


def draw_maps(name: str, found: Mapping[str, Any], picture: Path) -> None:
    """Draw the maps of a preset: the level in colour, blank white, anything else grey."""
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm, ListedColormap

    levels = len(found['levels'])
    colours = colormaps['viridis'](np.linspace(0.05, 1.0, levels))
    known = ListedColormap([style.FAINT_COLOUR, '#ffffff', *colours])
    norm = BoundaryNorm(np.arange(-2.5, levels), levels + 2)
    with style.style_context():
        figure = style.new_figure(5.0)
        grid = style.axes_grid(figure, 2, 3)
        grid.flat[-1].set_axis_off()
        for axes, (each, told), letter in zip(
            grid.flat[:-1], SHOWN_MAPS.items(), 'abcde', strict=True
        ):
            one = found['maps'][each]
            xs, ys = np.array(one['xs']), np.arange(len(one['ys']))
            mesh = axes.pcolormesh(xs, ys, parse_levels(one['rows']), cmap=known, norm=norm,
                                   shading='nearest', rasterized=True)  # fmt: skip
            axes.set(xscale='log', xlabel='speed', ylabel=told)
            ticks = ys[:: max(1, len(ys) // 5)]
            axes.set_yticks(ticks, [f'{one["ys"][k]:g}' for k in ticks])
            style.label_panel(axes, letter)
        bar = figure.colorbar(mesh, ax=grid, ticks=range(-2, levels), pad=0.01, aspect=40)
        bar.ax.set_yticklabels(['elsewhere', 'blank', *map(str, range(levels))])
        figure.suptitle(name)
        figure.savefig(picture, metadata={'Software': None})
