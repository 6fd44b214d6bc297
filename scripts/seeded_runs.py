# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Run the seeded runs of test/seeded_runs: one with its history, or many.

Usage: .venv/bin/python scripts/seeded_runs.py SEED, or with --count N [--first SEED].
"""

import argparse
import signal
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from rich.progress import track

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test'))

from seeded_runs.world import SeededRun, describe_run

RUN_TIMEOUT_S = 120
"""Seconds after which a run that takes the computer's time, not its own, is given up."""


def run_seed_with_timeout(seed: int) -> list[str]:
    """Return what is wrong in a run; it is given up if it does not end."""
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.alarm(RUN_TIMEOUT_S)
    try:
        return SeededRun(seed).run()
    except KeyboardInterrupt:
        return [f'it does not come back within {RUN_TIMEOUT_S} s of the computer']
    finally:
        signal.alarm(0)


def do_many_runs(first: int, count: int) -> int:
    """Do many runs on all cores and list those that fail; return the exit status."""
    seeds, failing = range(first, first + count), 0
    with ProcessPoolExecutor() as pool:
        every = zip(seeds, pool.map(run_seed_with_timeout, seeds, chunksize=50), strict=True)
        for seed, found in track(every, 'seeded runs', count):
            if found:
                failing += 1
                print(f'{seed}: {found[0]}', flush=True)
    print(f'{failing} of {count} runs fail', end='')
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
    return do_many_runs(arguments.first, arguments.count)


if __name__ == '__main__':
    sys.exit(main())
