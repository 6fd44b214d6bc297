# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Run the seeded runs of test/seeded_runs: one with its history, or many.

Usage: .venv/bin/python scripts/seeded_runs.py SEED, or with --count N [--first SEED].
"""

import argparse
import os
import sys
import time
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test'))

from seeded_runs.campaign import campaign, describe_run


def many(first: int, count: int) -> int:
    """Do many runs on all cores and list those that fail; return the exit status."""
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn('runs, {task.fields[pace]:.0f}/s, {task.fields[failing]} fail,'),
        TimeRemainingColumn(),
    )
    began = time.monotonic()
    with Progress(*columns, speed_estimate_period=600) as progress:
        task = progress.add_task('', total=count, failing=0, pace=0.0)

        def report(done: int, failing: dict[int, list[str]]) -> None:
            pace = done / (time.monotonic() - began)
            progress.update(task, completed=done, failing=len(failing), pace=pace)

        failing = campaign(first, count, os.cpu_count() or 1, report)
    print(f'{count / (time.monotonic() - began):.1f} runs a second')
    for seed, found in sorted(failing.items()):
        print(f'{seed}: {found[0]}')
    print(f'{len(failing)} of {count} runs fail', end='')
    print('; scripts/seeded_runs.py SEED prints the history of one' if failing else '')
    return 1 if failing else 0


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('seed', type=int, nargs='?', help='the run to do, with its history')
    parser.add_argument('--count', type=int, help='how many runs to do')
    parser.add_argument('--first', type=int, default=0, help='the first of them')
    arguments = parser.parse_args()
    if (arguments.seed is None) == (arguments.count is None):
        parser.error('give a SEED, or --count')
    if arguments.seed is not None:
        print(describe_run(arguments.seed))
        return 0
    return many(arguments.first, arguments.count)


if __name__ == '__main__':
    sys.exit(main())
