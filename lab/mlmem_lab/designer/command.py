# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design` beyond `check`: finds designs, and proves them by simulation."""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem.element_file import as_designed, text_of
from mlmem.instrument.end import End
from mlmem.law_file import read_law_file as load_law
from mlmem.physics import CASE_II
from mlmem.presets import load_preset
from mlmem.settings import ScaleSettings
from mlmem_tools.checks.capacity import list_capacities
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.schedule import compute_cycle_time
from mlmem_tools.cli.command import load_element_option
from mlmem_tools.cli.design import print_capacity, print_report
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..results import DEVICE_MODULES, load_kept, save_result
from ..studies.proof import Proof, Tally, evaluate_run
from ..study import map_kept
from . import DesignNotFound, Proposal, propose_design
from .pulses import dynamic_range
from .robust_command import find_robust

if TYPE_CHECKING:
    from rich.console import Console

    from mlmem import Settings
    from mlmem.element_file import Element
    from mlmem.physics import Design


def find(arguments: argparse.Namespace) -> int:
    """Find a design and write it; return the exit status."""
    try:
        if arguments.scatter is not None:
            return find_robust(arguments)
        return _run_find(arguments)
    except DesignNotFound as error:
        return print_failure('design', error, 2)


def prove(arguments: argparse.Namespace) -> int:
    """Simulate designs; return the exit status."""
    designs = [(Path(source).stem, *load_preset(source)) for source in arguments.sources]
    if element := load_element_option(arguments, *designs[0][1:]):
        designs = [(f'{designs[0][0]}-{arguments.element.stem}', *designs[0][1:])]
    return _show_proofs(
        create_console(aside=arguments.json),
        designs,
        arguments,
        arguments.markdown,
        arguments.output,
        element,
    )


def _run_find(arguments: argparse.Namespace) -> int:
    console = create_console(aside=arguments.json)
    if arguments.law is None:
        found, how = propose_design(arguments.levels), f'mlmem design --levels {arguments.levels}'
    else:
        found, how = _design_with_law(arguments, console)
    levels = found.design.levels
    text = f'# {levels} levels, by `{how}`.\n' + text_of(as_designed(found.design, found.settings))
    if arguments.json and not arguments.prove:
        print_json(
            {
                'design': found.design,
                'settings': found.settings,
                'verdict': found.report.verdict.value,
                'file': arguments.output,
            }
        )
    if arguments.output is None:
        print(text, end='', file=console.file)  # and nothing else, so that it can be piped
    else:
        arguments.output.write_text(text, encoding='utf-8')
        console.print(f'written: {arguments.output}')
        for number, reason in found.reasons.items():
            console.print(f'not {number} cells per level: {reason}')
        print_report(console, f'{levels} levels', found.report, brief=True)
        print_capacity(console, list_capacities(found.design, found.settings))
    if not arguments.prove:
        return 0
    name = f'levels_{levels}'
    return _show_proofs(console, [(name, found.design, found.settings)], arguments, None)


def _design_with_law(arguments: argparse.Namespace, console: Console) -> tuple[Proposal, str]:
    """Return a design of cells with a law, of the most levels if none are given, and its command.

    Raises:
        DesignNotFound: They can be no such memory.
    """
    scale = ScaleSettings(
        length=arguments.length, stiffness=arguments.spring,
        time=math.sqrt(max(0.0, arguments.mass / (arguments.spring or math.inf))),
    )  # fmt: skip
    law = load_law(arguments.law, scale.length, scale.stiffness)
    cell = dataclasses.replace(CASE_II, d=1.0, phase=arguments.phase, law=law)
    tried = [arguments.levels] if arguments.levels else [2**bits for bits in range(1, 9)]
    found = None
    for levels in tried:
        try:
            with console.status(f'{levels} levels'):
                found = propose_design(levels, cell)
        except DesignNotFound as error:
            if found is None:
                raise
            console.print(f'{error}', soft_wrap=True)
            break
    assert found is not None
    console.print(
        f'{found.design.levels} levels, with a gradient of {found.design.gamma:.3g} per cell'
    )
    settings = dataclasses.replace(found.settings, scale=scale)
    how = (
        f'mlmem design --law {arguments.law} --length {scale.length:g} --spring '
        f'{scale.stiffness:g} --mass {arguments.mass:g} --levels {found.design.levels}'
    )
    return dataclasses.replace(found, settings=settings), how


def _show_proofs(
    console: Console,
    designs: list[tuple[str, Design, Settings]],
    arguments: argparse.Namespace,
    table_file: Path | None,
    result_file: Path | None = None,
    element: Element | None = None,
) -> int:
    """Prove designs and print the table of them; return the exit status."""
    proofs, passed = [], True
    for name, design, settings in designs:
        with console.status(f'{name}: calibrating {design.levels} levels'):
            proof = Proof(design, settings, arguments.sample, element=element)
            shared = proof.prepare_bench()
        runs = {f'{k}': (shared, point) for k, point in enumerate(proof.points())}
        file = arguments.folder / f'{name}.json'
        try:
            rows = map_kept(
                console, f'{name}: runs', evaluate_run, runs, arguments.jobs, file, shared
            )
        except (OSError, ValueError) as error:
            return print_failure('design', error, 1)
        tally = Tally.of(rows.values())
        proofs.append(table_cells(name, design, settings, tally))
        passed = passed and not tally.errors
        for text in tally.errors:
            console.print(f'{name}: {text}', style='red')
    columns = [list(proofs[0]), *(list(proof.values()) for proof in proofs)]
    (_, *names), *lines = zip(*columns, strict=True)
    table = create_table('', '', *names)
    for line in lines:
        table.add_row(*line)
    console.print(table)
    if arguments.json:
        print_json({'passed': passed, 'proofs': proofs})
    if table_file is not None:
        table_file.write_text(_format_markdown(columns), encoding='utf-8')
    if result_file is not None:
        kept = load_kept(result_file)
        made = ' '.join(['mlmem design prove', *names])
        made += '' if arguments.sample is None else f' --sample {arguments.sample}'
        made = f'{kept["command"]} && {made}' if kept else made
        proven = {name: dict(proof) for name, proof in zip(names, proofs, strict=True)}
        proven = kept.get('presets', {}) | proven
        modules = [*DEVICE_MODULES, 'lab/mlmem_lab/studies/proof.py']
        save_result(result_file, {'presets': proven}, made, modules, names, kept=kept)
    return 0 if passed else 1


def _format_markdown(lines: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; the first line has the headings."""
    heading, *rows = ('| ' + ' | '.join(line) + ' |\n' for line in lines)
    return ''.join((heading, '|' + '---|' * len(lines[0]) + '\n', *rows))


def table_cells(name: str, design: Design, settings: Settings, tally: Tally) -> dict[str, str]:
    """Return what the table says of a design, by heading."""
    write, subject = settings.write, Subject(design, settings)
    end = End.RIGHT if settings.read.end == End.RIGHT else End.LEFT
    probe = end.probe(settings)
    times = write.ramp, write.hold, write.ease, write.release, write.settle
    step = compute_cycle_time(subject, write)
    unit = settings.scale.time
    return {
        'preset': name,
        'levels': f'{design.levels}',
        'N': f'{design.N}',
        'J': f'{design.J}',
        'gamma': f'{design.gamma:.3g}',
        'beta': f'{design.beta:.3g}',
        '1/eta': f'{1.0 / design.eta:.0f}' if design.eta else 'none',
        'ramp, hold, ease, release, settle': ', '.join(f'{time:.0f}' for time in times),
        'peaks': f'{write.compression:.4g}, {write.tension:+.4g}',
        'read from, carrier, sigma': f'{settings.read.end}, {probe.omega_c:g}, {probe.sigma:g}',
        'echo range, dB': f'{dynamic_range(subject):.0f}',
        'written and read back': '{} of {}'.format(*tally.upward),
        'written downward': '{} of {}'.format(*tally.down),
        'erased': '{} of {}'.format(*tally.erase),
        'read in a row': '{} of {}'.format(*tally.read),
        'least level margin': f'{tally.level_margin:.2f}',
        'time per level': f'{step:.0f}',
        'in s': f'{step * unit:.2g}',
        'longest erase, s': f'{tally.erase_time * unit:.3g}',
    }
