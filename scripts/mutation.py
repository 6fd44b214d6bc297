# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Print what share of a random sample of mutants the tests kill, and the survivors.

A mutant is the package with one expression of what pyproject.toml names changed.
The first test that fails kills it. mutmut makes mutants and runs the tests that reach the changed
function (its settings are in pyproject.toml); its results stay in `mutants/`. It does not change
properties, context managers and code outside functions, and it credits what a shared fixture calls
only to the first test that uses it.
"""

import argparse
import json
import random
import subprocess
import sys
from collections import Counter
from pathlib import Path

from mutmut.stats import status_by_exit_code
from scipy.stats import binomtest

from mlmem.instrument.actuator import _follow_course as quick

CHECKOUT_ROOT = Path(__file__).resolve().parent.parent
MUTANT_FOLDER = CHECKOUT_ROOT / 'mutants'
QUICK_MUTANT = f'{quick.__module__}.x_{quick.__name__}__mutmut_1'
"""A quick mutant: mutmut makes all of them when it runs any."""

KILLED_STATUSES = 'killed', 'timeout'
"""Statuses of a mutant that a user of the tests would notice."""

NOT_RUN_EXIT_CODE = 255
"""Exit code of a worker whose tests could not be run; mutmut takes it for a timeout."""


def main() -> int:
    """Run the sample and print the table; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--sample', type=int, default=160, help='mutants to run')
    parser.add_argument('--seed', type=int, default=1, help='which sample')
    parser.add_argument('--jobs', type=int, default=1, help='processes at once')
    given = parser.parse_args()
    run_mutmut('run', '--max-children', str(given.jobs), QUICK_MUTANT)
    names = sorted(read_statuses())
    sample = random.Random(given.seed).sample(names, min(given.sample, len(names)))
    print(f'{len(sample)} of {len(names)} mutants, seed {given.seed}', flush=True)
    run_mutmut('run', '--max-children', str(given.jobs), *sample)
    found = {name: status for name, status in read_statuses().items() if name in set(sample)}
    for package in ('mlmem.', 'mlmem_tools.checks.', 'mlmem_ros.bag.', 'mlmem_ros.session.', ''):
        part = [status for name, status in found.items() if name.startswith(package)]
        print(f'{package or "all":20}{summarise_statuses(part)}')
    for name, status in sorted(found.items()):
        if status not in KILLED_STATUSES:
            print(f'\n{run_mutmut("show", name)}', end='')
    return 0


def run_mutmut(*arguments: str) -> str:
    """Run mutmut and return what it says; end with that where it fails."""
    command = [sys.executable, '-m', 'mutmut', *arguments]
    done = subprocess.run(command, cwd=CHECKOUT_ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f'{done.stdout[-4000:]}{done.stderr[-4000:]}')
    return done.stdout


def read_statuses() -> dict[str, str]:
    """Return what became of every mutant, by its name."""
    found = {}
    for path in MUTANT_FOLDER.rglob('*.py.meta'):
        codes = json.loads(path.read_text())['exit_code_by_key']
        for name, code in codes.items():
            found[name] = 'not run' if code == NOT_RUN_EXIT_CODE else status_by_exit_code[code]
    return found


def summarise_statuses(statuses: list[str]) -> str:
    """Return the share that was killed with its 95 % interval, and the counts."""
    killed = sum(status in KILLED_STATUSES for status in statuses)
    low, high = binomtest(killed, len(statuses)).proportion_ci(0.95, 'exact')
    counts = ', '.join(f'{status} {count}' for status, count in Counter(statuses).most_common())
    return f'{killed / len(statuses):6.1%} ({low:.1%} to {high:.1%}): {counts}'


if __name__ == '__main__':
    sys.exit(main())
