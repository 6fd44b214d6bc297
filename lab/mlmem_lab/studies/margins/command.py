# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem margins`: find for which settings a memory works, and how far its own are from failure.

Every point of the map is a separate device that writes all levels, from 0 up, one attempt each,
every one verified by its echo and compared with the true wall. The map is drawn as PNG and SVG,
along with the table of all points, margins.json and the ledger. A map that was interrupted or
killed continues when the command is repeated. No ROS is needed.

An axis is any setting that is a number (write.hold, probe.v_th, ...); ramps, which sets
write.ramp and write.release alike; or noise, the temperature k_B T of the cells in k_r cells^2.
Writes go up by steps of strain alone.
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem_ros.contract.answers import outcome_to_dict
from mlmem_tools.cli.command import (
    ELEMENT_OPTION,
    JSON_OPTION,
    declare_command,
    declare_option,
    load_element_option,
)
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..campaign import terminal as campaigns

if TYPE_CHECKING:
    from rich.console import Console

    from ..campaign import Row
    from . import Margins, Shmoo


MARGIN_OPTIONS = (
    declare_option('--x', default='write.compression', help='horizontal axis'),
    declare_option('--y', default='write.tension', help='vertical axis'),
    *(
        declare_option(
            f'--{axis}-range', type=float, nargs=2, metavar=('FROM', 'TO'),
            help=f'where the map begins and ends along {axis}; wide by default',
        )
        for axis in ('x', 'y')
    ),
    declare_option('--size', type=int, default=64, help='points along either axis'),
    declare_option(
        '--design', default='case_2', metavar='FILE|PRESET',
        help='element file or preset: the design, and the operating point',
    ),
    ELEMENT_OPTION,
    declare_option(
        '--tick', type=float,
        help='tick in time units; every wait is rounded up to whole ticks. By default 50, which '
        'is fast to simulate, if that rounds no time of the schedule; otherwise that of the '
        'design',
    ),
    declare_option('--output', type=Path, help='folder; margins/X-Y by default'),
    declare_option('--figure', type=Path, metavar='PNG', help='draw the map here, too'),
    *campaigns.CAMPAIGN_OPTIONS,
    JSON_OPTION,
)  # fmt: skip


@declare_command(
    'map for which settings the memory works, and measure its margins',
    *MARGIN_OPTIONS,
    text=__doc__,
)
def margins(arguments: argparse.Namespace) -> int:
    """Draw a map; return 0 when it was drawn, 1 when it could not be, 2 for a wrong argument."""
    from mlmem.presets import load_preset

    from ..campaign import CampaignError
    from . import Shmoo, make_axis, prepare_settings

    console = create_console(aside=arguments.json)
    try:
        design, settings = load_preset(arguments.design)
        element = load_element_option(arguments, design, settings)
        settings = prepare_settings(settings, arguments.tick)
        x = make_axis(arguments.x, settings, arguments.x_range)
        y = make_axis(arguments.y, settings, arguments.y_range)
        shmoo = Shmoo(design, settings, x, y, arguments.size, arguments.seed, element)
        if arguments.point is not None:
            return _run_point(console, shmoo, arguments.point, arguments.json)
        folder = arguments.output or Path('margins') / f'{x.name}-{y.name}'
        rows = campaigns.evaluate_missing(
            console, shmoo.campaign(), folder / 'ledger.jsonl', arguments.jobs, arguments.cluster
        )
        _report_map(console, shmoo, rows, folder, arguments)
    except ValueError as error:
        return print_failure('margins', error, 2)
    except (CampaignError, OSError) as error:
        return print_failure('margins', error, 1)
    return 0


def _report_map(
    console: Console, shmoo: Shmoo, rows: list[Row], folder: Path, arguments: argparse.Namespace
) -> None:
    """Save table, margins and map, and print a summary."""
    from mlmem.atomic_files import write_atomically

    from ...results import DEVICE_MODULES, keep_picture
    from ..campaign import save_table
    from ..style import save_figure, style_context
    from . import draw_map, measure_margins

    margins = measure_margins(shmoo, rows)
    files = [save_table(rows, folder / 'points.csv'), folder / 'margins.json']
    write_atomically(files[-1], json.dumps(margins.as_dict(), indent=2) + '\n')
    with style_context():
        files += save_figure(draw_map(shmoo, rows, margins), folder / 'map')
    if arguments.figure is not None:
        shutil.copyfile(folder / 'map.png', arguments.figure)
        made = f'mlmem margins --x {arguments.x} --y {arguments.y} --size {arguments.size} '
        made += f'--design {arguments.design} --figure {arguments.figure}'
        keep_picture(arguments.figure, made, [*DEVICE_MODULES, 'lab/mlmem_lab/studies'])
    for line in (*_summarise_margins(margins), '  '.join(map(str, files))):
        console.print(line, highlight=False, soft_wrap=True)
    if arguments.json:
        print_json({**margins.as_dict(), 'files': files})


def _summarise_margins(margins: Margins) -> list[str]:
    """Return a summary of a map, line by line."""
    lines = [f'{margins.share:.1%} of the points pass']
    for reach in margins.reaches:
        axis, ends = reach.axis, []
        for value, is_open in ((reach.low, reach.low_open), (reach.high, reach.high_open)):
            change = f' ({value / axis.operating - 1.0:+.0%})' if axis.operating else ''
            ends.append(f'{value:.4g}{change}{", the end of the map" if is_open else ""}')
        lines.append(f'{axis.name} {axis.operating:g}: passes from {ends[0]} to {ends[1]}')
    near, where = margins.nearest, margins.nearest_failure
    if near is not None:
        where = f'{where}: {near["failure"]} at level {near["reached"]} (point {near["point"]})'
    return [*lines, where]


def _run_point(console: Console, shmoo: Shmoo, point: int, as_json: bool) -> int:
    """Run one point of the table alone and print its writes."""
    from mlmem import SettingsError

    from . import rerun_point

    study = shmoo.campaign()
    study.check_point(point)
    values, seed = study.points[point], study.point_seed(point)
    names = ', '.join(f'{name} {value:g}' for name, value in values.items())
    console.print(f'point {point}: {names}; seed {seed}', highlight=False)
    try:
        climb = rerun_point(study.common, values, seed)
    except SettingsError as error:
        console.print(f'the settings give no device: {error}', highlight=False)
        if as_json:
            print_json({'point': point, 'passed': False, 'error': error})
        return 0
    table = create_table(
        '', '>asked', '>decoded', '>delay', '>level margin', '>threshold margin', '>true wall',
        'outcome',
    )  # fmt: skip
    for each in climb.writes:
        reading = each.outcome.reading
        heard = ['', '', '', ''] if reading is None else [
            str(reading.level), '' if reading.delay is None else f'{reading.delay:.2f}',
            f'{reading.level_margin:.3f}', f'{reading.threshold_margin:.2f}',
        ]  # fmt: skip
        words = f'{each.failure}: {each.outcome.error}' if each.failure else 'as asked'
        table.add_row(str(each.asked), *heard, f'{each.wall:.2f}', words)
    console.print(table)
    console.print('passes' if climb.passed else f'fails at level {climb.reached}')
    if as_json:
        steps = [
            {'asked': each.asked, 'wall': each.wall, 'failure': each.failure}
            | outcome_to_dict(each.outcome)
            for each in climb.writes
        ]
        print_json({'point': point, 'passed': climb.passed, 'steps': steps})
    return 0
