# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Loops in tests: a virtual clock for them, and their answers.

A `Clock` advances when the loop sleeps and when a tick of a test is slow, and stops at its end, so
that the expected times are exact.
"""

import math
import threading
import time

from mlmem import Refused

PERIOD = 0.002
"""Of a tick: 20 time units of 1e-4 s."""

PATIENCE = 60.0
"""Seconds a test waits for what has to come; on a loaded machine it takes a while."""


class Clock:
    """A clock that advances while somebody sleeps on it, up to an end where it stops."""

    slack = 0.0

    def __init__(self, end=math.inf):
        self.time = 0.0
        self.end = end
        self._lock = threading.Lock()

    def now(self):
        return self.time

    def wait(self, changed, seconds):
        with self._lock:
            stands = self.time >= self.end
            if not stands:
                self.time = min(self.time + seconds, self.end)
        if stands:
            changed.wait(1e-3)


def until(condition):
    """Wait until a condition holds."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, 'it did not come true'
        time.sleep(1e-3)


def result(asked):
    """Return the answer to a request, or the result of a future."""
    return getattr(asked, 'answer', asked).result(PATIENCE)


def refusal(asked):
    error = getattr(asked, 'answer', asked).exception(PATIENCE)
    assert isinstance(error, Refused)
    return str(error)


def hold(loop):
    """Pause a loop after the tick in progress; return the ticks done."""
    return result(loop.pause(True))
