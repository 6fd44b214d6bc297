# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many lives: which fail, on how many processes, how fast; and a single one."""

import signal
import time
from concurrent.futures import ProcessPoolExecutor, as_completed

from .script import script
from .shrink import shrunk
from .world import Life

AT_ONCE = 50
"""Lives that a process is given at a time."""

LONGEST = 120
"""Seconds after which a life that takes the computer's time, not its own, is given up."""


class Stuck(BaseException):
    """A life does not end."""


def live(seed):
    """Return what is wrong in the life with this number."""
    return Life(script(seed)).live()


def fails(given):
    """Return whether a script fails."""
    return bool(Life(given).live())


def story(seed):
    """Live the life with this number; if it fails, shorten it while it still fails, and describe
    it.
    """
    given = script(seed)
    if fails(given):
        given = shrunk(given, fails)
    life = Life(given)
    found = life.live()
    lines = [f'{at:12.6f}  {who}: {_told(what)}' for at, who, what in life.scheduler.history]
    findings = [f'FOUND {finding}' for finding in found] or ['nothing is wrong']
    return '\n'.join([*lines, '', str(given), '', *findings])


def campaign(first, count, processes=2, told=lambda done, failing: None):
    """Live many lives; return the seeds of those that fail, with the findings.

    Args:
        first: The first seed.
        count: Number of lives.
        processes: Number of processes that share them.
        told: Called now and then with the number of lives done and the failures so far.
    """
    failing, done = {}, 0
    with ProcessPoolExecutor(processes) as pool:
        parts = [range(at, min(at + AT_ONCE, first + count))
                 for at in range(first, first + count, AT_ONCE)]  # fmt: skip
        for part in as_completed([pool.submit(_failing, seeds) for seeds in parts]):
            lived, found = part.result()
            done += lived
            failing |= found
            told(done, failing)
    return failing


def _failing(seeds):
    return len(seeds), {seed: found for seed in seeds if (found := _timed(seed))}


def _timed(seed):
    signal.signal(signal.SIGALRM, _give_up)
    signal.alarm(LONGEST)
    began = time.monotonic()
    try:
        return live(seed)
    except Stuck:
        return [f'it does not come back within {time.monotonic() - began:.0f} s of the computer']
    finally:
        signal.alarm(0)


def _give_up(*_):
    raise Stuck


def _told(what):
    return ' '.join(map(str, what)) if isinstance(what, tuple) else what
