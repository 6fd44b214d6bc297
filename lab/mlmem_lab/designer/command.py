# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design` beyond `check`: finds elements, and proves them by simulation."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem.element_file import as_designed, text_of
from mlmem.errors import SettingsError
from mlmem.physics import Specimen
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import make_blank
from mlmem.readers.one_wall import forecast_levels
from mlmem.readers.reading import BLANK
from mlmem_tools.checks.budget import Budget
from mlmem_tools.cli.command import load_judged_element
from mlmem_tools.cli.output import (
    create_console,
    create_table,
    print_failure,
    print_json,
    show_progress,
)
from mlmem_tools.identification.kick_search import after_erase, build_chain, build_kick, drive_end

from ..studies.proof import Proof, Tally, describe_proof, evaluate_run
from ..study import count_cores, map_calls, provide_workers
from ..windows.astray import count_astray
from .search import DesignNotFound, DesignRequest, choose_speeds, search_values, try_speeds

if TYPE_CHECKING:
    from rich.console import Console

    from mlmem import Settings
    from mlmem.element_file import Element
    from mlmem.physics import Design
    from mlmem.physics.values import Array


def find(arguments: argparse.Namespace) -> int:
    """Search an element for levels, scatter and friction, and write its file; return the exit
    status.
    """
    piped = arguments.output is None and not arguments.json
    console = create_console(aside=piped or arguments.json)
    request = DesignRequest(arguments.levels, arguments.scatter, arguments.friction)
    try:
        design, settings = search_element(console, request, arguments.jobs, arguments.trials)
    except DesignNotFound as error:
        return print_failure('design', error, 2)
    with console.status('counting kicks'):
        described = describe_element(design, settings, request.scatter)
    table = create_table('', '', '>found')
    for heading, value in described.items():
        table.add_row(heading, value)
    console.print(table)
    how = (
        f'mlmem design --levels {request.levels} --scatter {request.scatter:g} '
        f'--friction {request.friction:g}'
    )
    text = f'# {request.levels} levels, by `{how}`.\n' + text_of(as_designed(design, settings))
    if arguments.json and not arguments.prove:
        print_json({
            'design': design, 'settings': settings, 'file': arguments.output,
            'found': described,
        })  # fmt: skip
    if piped:
        print(text, end='')
    if arguments.output is not None:
        arguments.output.write_text(text, encoding='utf-8')
        console.print(f'written: {arguments.output}')
    if not arguments.prove:
        return 0
    return _show_proofs(console, [(f'{request.levels} levels', design, settings, None)], arguments)


def prove(arguments: argparse.Namespace) -> int:
    """Simulate designs; return the exit status."""
    designs = []
    for source in arguments.sources:
        element, individual = load_judged_element(source)
        designs.append((Path(source).stem, element.design, element.settings, individual))
    return _show_proofs(create_console(aside=arguments.json), designs, arguments)


def search_element(
    console: Console, request: DesignRequest, jobs: int | None, trials: int
) -> tuple[Design, Settings]:
    """Return the best element of a search; raises as `choose_speeds`."""
    tried: list[tuple[float, Array]] = []
    with provide_workers(jobs or count_cores()) as pool:
        found = search_values(request, pool, trials)
        show_progress(console, map(tried.append, found), trials, 'trials')
    values = min(tried, key=lambda each: each[0])[1].tolist()
    seeds = range(100, 124)  # of the elements whose kicks choose the speeds
    count = len(seeds)
    ends = map_calls(
        console, jobs or count_cores(), 'speeds', try_speeds,
        [request] * count, [values] * count, seeds,
    )  # fmt: skip
    return choose_speeds(request, values, ends)


def describe_element(design: Design, settings: Settings, scatter: float) -> dict[str, str]:
    """Return what is printed of an element, by heading."""
    counted = count_astray(design, settings, scatter, elements=20)
    chain, kick = build_chain(Specimen(design), settings), settings.kick
    levels = range(design.levels)
    erased = sum(after_erase(chain, level, kick.erase_speed, kick) == BLANK for level in levels)
    stroke = abs(design.D_s2 - design.D_s1)
    slowest, fastest = min(kick.wall_speeds), max(kick.wall_speeds)
    allowed = Budget(design).friction
    return {
        'levels': f'{design.levels}',
        'cells': f'{design.N}',
        'cells a level': f'{design.J}',
        f'astray at {scatter:g}': '{astray} of {kicks}'.format(**counted),
        'levels erased by a kick': f'{erased} of {design.levels}',
        'friction of a cell': f'{design.friction:g}',
        'allowed friction': f'{allowed:.2g}' if allowed else '-',  # no law for narrow walls
        'slowest kick, time units': f'{stroke / slowest + kick.hold + kick.settle:.0f}',
        'energy of the fastest kick': f'{measure_kick_energy(design, settings, fastest):.3g}',
        'highest speed of the end': f'{kick.peak_speed_ratio * fastest:.3g}',
        'least difference of two echoes': _format_echo(design, settings),
    }


def _format_echo(design: Design, settings: Settings) -> str:
    """Return the least distance of two forecasts over the pulse; '-' without forecasts."""
    if settings.read.method != 'waveform':
        return '-'
    try:
        found = forecast_levels(Specimen(design), settings)
    except SettingsError:  # a level pins no wall
        return 'none'
    share = found.least_distance / found.pulse_size
    return '-' if math.isnan(share) else f'{share:.1%}'


def _show_proofs(
    console: Console,
    designs: list[tuple[str, Design, Settings, Element | None]],
    arguments: argparse.Namespace,
) -> int:
    """Prove designs and print the table of them; return the exit status."""
    proofs, passed = {}, True
    for name, design, settings, element in designs:
        with console.status(f'{name}: calibrating {design.levels} levels'):
            proof = Proof(design, settings, arguments.sample, element=element)
            _ = proof.calibration
        points = proof.points()
        rows = map_calls(
            console, arguments.jobs or count_cores(), f'{name}: runs', evaluate_run,
            [proof] * len(points), points,
        )  # fmt: skip
        tally = Tally.of(rows)
        proofs[name] = describe_proof(design, settings, tally)
        passed = passed and not tally.errors
        for text in tally.errors:
            console.print(f'{name}: {text}', style='red')
    table = create_table('', '', *proofs)
    for heading in next(iter(proofs.values())):
        table.add_row(heading, *(proof[heading] for proof in proofs.values()))
    console.print(table)
    if arguments.json:
        print_json({'passed': passed, 'proofs': proofs})
    return 0 if passed else 1


def measure_kick_energy(design: Design, settings: Settings, speed: float) -> float:
    """Return the energy that a kick gives a blank element, in k_r a^2: kinetic and potential."""
    chain = build_chain(Specimen(design), settings)
    chain.place(make_blank(chain.specimen))
    before = energy(chain).total
    drive_end(chain, build_kick(chain, speed, settings.kick), 0.0)
    return energy(chain).total - before
