# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many runs: which fail, on how many processes, how fast; and a single one."""

import signal
import time
from concurrent.futures import ProcessPoolExecutor, as_completed

from .script import script
from .world import SeededRun

RUNS_PER_TASK = 50
"""Runs that a process is given at a time."""

RUN_TIMEOUT_S = 120
"""Seconds after which a run that takes the computer's time, not its own, is given up."""


class Stuck(BaseException):
    """A run does not end."""


def run_seed(seed):
    """Return what is wrong in the run with this number."""
    return SeededRun(script(seed)).run()


def describe_run(seed):
    """Do the run with this number, and describe it."""
    run = SeededRun(script(seed))
    found = run.run()
    lines = [
        f'{at:12.6f}  {who}: {" ".join(map(str, what)) if isinstance(what, tuple) else what}'
        for at, who, what in run.scheduler.history
    ]
    findings = [f'FOUND {finding}' for finding in found] or ['nothing is wrong']
    return '\n'.join([*lines, '', str(run.script), '', *findings])


def campaign(first, count, processes=2, report=lambda done, failing: None):
    """Do many runs; return the seeds of those that fail, with the findings.

    Args:
        first: The first seed.
        count: Number of runs.
        processes: Number of processes that share them.
        report: Called now and then with the number of runs done and the failures so far.
    """
    failing, done = {}, 0
    with ProcessPoolExecutor(processes) as pool:
        parts = [range(at, min(at + RUNS_PER_TASK, first + count))
                 for at in range(first, first + count, RUNS_PER_TASK)]  # fmt: skip
        for part in as_completed([pool.submit(_run_seeds, seeds) for seeds in parts]):
            count_done, found = part.result()
            done += count_done
            failing |= found
            report(done, failing)
    return failing


def _run_seeds(seeds):
    return len(seeds), {seed: found for seed in seeds if (found := _run_with_timeout(seed))}


def _run_with_timeout(seed):
    signal.signal(signal.SIGALRM, _give_up)
    signal.alarm(RUN_TIMEOUT_S)
    began = time.monotonic()
    try:
        return run_seed(seed)
    except Stuck:
        return [f'it does not come back within {time.monotonic() - began:.0f} s of the computer']
    finally:
        signal.alarm(0)


def _give_up(*_):
    raise Stuck
