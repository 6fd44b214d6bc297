# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many runs: which fail, on how many processes, how fast; and a single one."""

import signal
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace

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


def fails(given):
    """Return whether a script fails."""
    return bool(SeededRun(given).run())


def shrink(script, fails, max_runs=400):
    """Return a script of few steps that still fails.

    Args:
        script: A script that fails.
        fails: Returns whether a script fails.
        max_runs: Most runs for it.
    """
    runs = 0
    steps = script.steps
    size = max(1, len(steps) // 2)
    while runs < max_runs:
        shorter = None
        for begin in range(0, len(steps), size):
            rest = steps[:begin] + steps[begin + size :]
            runs += 1
            if fails(replace(script, steps=rest)):
                shorter = rest
                break
        if shorter is not None:
            steps = shorter
            size = max(1, min(size, len(steps) // 2))
        elif size > 1:
            size //= 2
        else:
            break
    return replace(script, steps=steps)


def describe_run(seed):
    """Do the run with this number; if it fails, shorten it while it still fails, and describe
    it.
    """
    given = script(seed)
    if fails(given):
        given = shrink(given, fails)
    run = SeededRun(given)
    found = run.run()
    lines = [
        f'{at:12.6f}  {who}: {" ".join(map(str, what)) if isinstance(what, tuple) else what}'
        for at, who, what in run.scheduler.history
    ]
    findings = [f'FOUND {finding}' for finding in found] or ['nothing is wrong']
    return '\n'.join([*lines, '', str(given), '', *findings])


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
