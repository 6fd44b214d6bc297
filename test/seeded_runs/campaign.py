# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs by their numbers: what is wrong in one, and its history."""

import signal
from pprint import pformat

from .script import make_script
from .world import SeededRun

RUN_TIMEOUT_S = 120
"""Seconds after which a run that takes the computer's time, not its own, is given up."""


class Stuck(BaseException):
    """A run does not end."""


def run_seed(seed):
    """Return what is wrong in the run with this number."""
    return SeededRun(make_script(seed)).run()


def run_seed_with_timeout(seed):
    """Return the same; the run is given up if it does not end."""
    signal.signal(signal.SIGALRM, _raise_stuck)
    signal.alarm(RUN_TIMEOUT_S)
    try:
        return run_seed(seed)
    except Stuck:
        return [f'it does not come back within {RUN_TIMEOUT_S} s of the computer']
    finally:
        signal.alarm(0)


def _raise_stuck(*_):
    raise Stuck


def describe_run(seed):
    """Do the run with this number, and describe it."""
    run = SeededRun(make_script(seed))
    found = run.run()
    lines = [
        f'{at:12.6f}  {who}: {" ".join(map(str, what)) if isinstance(what, tuple) else what}'
        for at, who, what in run.scheduler.history
    ]
    findings = [f'FOUND {finding}' for finding in found] or ['nothing is wrong']
    return '\n'.join([*lines, '', pformat(run.script, width=99), '', *findings])
