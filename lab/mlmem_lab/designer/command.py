# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design` beyond `check`: finds designs, and proves them by simulation."""

from __future__ import annotations

import argparse
import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem import load_element
from mlmem.element_file import as_designed, text_of
from mlmem.law_file import read_law_file as load_law
from mlmem.physics import CASE_II
from mlmem.settings import ScaleSettings
from mlmem_tools.cli.command import load_element_option
from mlmem_tools.cli.design import print_report
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

from ..studies.proof import Proof, Tally, describe_proof, evaluate_run
from ..study import count_cores, map_calls
from . import DesignNotFound, Proposal, propose_design
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
    designs = [
        (Path(source).stem, *load_element(source).design_and_settings)
        for source in arguments.sources
    ]
    if element := load_element_option(arguments, *designs[0][1:]):
        designs = [(f'{designs[0][0]}-{arguments.element.stem}', *designs[0][1:])]
    return _show_proofs(create_console(aside=arguments.json), designs, arguments, element)


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
    if not arguments.prove:
        return 0
    name = f'levels_{levels}'
    return _show_proofs(console, [(name, found.design, found.settings)], arguments)


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
    element: Element | None = None,
) -> int:
    """Prove designs and print the table of them; return the exit status."""
    proofs, passed = {}, True
    for name, design, settings in designs:
        with console.status(f'{name}: calibrating {design.levels} levels'):
            proof = Proof(design, settings, arguments.sample, element=element)
            shared = proof.prepare_bench()
        points = proof.points()
        rows = map_calls(
            console, arguments.jobs or count_cores(), f'{name}: runs', evaluate_run,
            [shared] * len(points), points,
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
