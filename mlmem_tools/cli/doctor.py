# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem doctor`: check whether this machine has what a memory needs, and say what to do.

Exit status 0: nothing failed (warnings do not count); 1: something did.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from .command import JSON_OPTION, NODE_OPTION, declare_command, declare_option, declare_wait
from .output import print_json

if TYPE_CHECKING:
    from .checkup import Diagnosis

VERDICT_COLOURS = {'pass': 32, 'warn': 33, 'fail': 31}
"""Colours of a terminal, by verdict: green, yellow and red."""


@declare_command(
    'check whether this machine has what a memory needs',
    NODE_OPTION,
    declare_wait(3.0),
    declare_option(
        '--records', type=Path, default=Path('sessions'), help='where sessions are recorded'
    ),
    declare_option(
        '--warm',
        action='store_true',
        help='first compile the kernels and check the elements, so that a node starts in a second',
    ),
    JSON_OPTION,
    text=__doc__,
)
def doctor(arguments: argparse.Namespace) -> int:
    """Check everything and print a table; return the exit status."""
    from mlmem_ros import __version__
    from mlmem_ros.host.design_check import Verdict

    from .checkup import examine_machine

    stream = sys.stderr if arguments.json else sys.stdout
    print(f'mlmem_ros {__version__}', file=stream)
    findings = []
    if arguments.warm:
        begun = time.monotonic()
        for name, do in list_start_tasks():
            print(f'warm  {name}', flush=True, file=stream)
            do()
        taken = time.monotonic() - begun
        print(f'warm: compiled and cached everything in {taken:.1f} s', file=stream)
    for finding in examine_machine(arguments.node, arguments.wait, arguments.records):
        print(format_diagnosis(finding, colour=stream.isatty()), flush=True, file=stream)
        findings.append(finding)
    verdicts = [finding.verdict for finding in findings]
    failed, warned = verdicts.count(Verdict.FAIL), verdicts.count(Verdict.WARN)
    print(f'{len(findings)} checks: {failed} failed, {warned} with a warning', file=stream)
    if arguments.json:
        print_json({'version': __version__, 'findings': findings})
    return 1 if failed else 0


def format_diagnosis(diagnosis: Diagnosis, colour: bool = False) -> str:
    """Return a diagnosis as a row of the table, with a second line of advice if there is any."""
    verdict = diagnosis.verdict.value
    if colour:
        verdict = f'\x1b[{VERDICT_COLOURS[verdict]}m{verdict}\x1b[0m'
    advice = f'\n{"":25} -> {diagnosis.advice}' if diagnosis.advice else ''
    return f'{verdict}  {diagnosis.what:<18} {diagnosis.seen}{advice}'


def list_start_tasks() -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield what a first start does and caches: the kernels, then the checks that run them."""
    from mlmem.physics import CASE_II, INTEGRATORS, Chain
    from mlmem.presets import PRESETS
    from mlmem_ros.host.design_check import load_findings

    for name, integrator in INTEGRATORS.items():
        for substrate in ('rigid', 'elastic'):
            chain = Chain(replace(CASE_II, substrate=substrate), integrator=integrator)
            yield f'kernel {name}, {substrate} substrate', partial(chain.rest, 1)
    for name, preset in PRESETS.items():
        yield f'design check of {name}', partial(load_findings, preset.design, preset.settings)
