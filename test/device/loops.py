# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Loops in tests: a virtual clock for them, and their answers."""

import math
import time

from mlmem import Refused

PERIOD = 0.002
"""Of a tick: 20 time units of 1e-4 s."""

PATIENCE = 60.0
"""Seconds a test waits for what has to come; on a loaded machine it takes a while."""


class Clock:
    """A clock that advances while the loop sleeps on it, up to an end where it stops: so that the
    expected times are exact. At their times things happen, which end the sleep only if they wake
    the loop.
    """

    slack = 0.0

    def __init__(self, happens=(), end=math.inf):
        self.time, self.end = 0.0, end
        self.happens = sorted(happens, key=lambda each: each[0])

    def now(self):
        return self.time

    def wait(self, changed, seconds):
        """Sleep; called with the lock of `changed` held."""
        if self.time >= self.end:
            changed.wait(1e-3)
            return
        until, woken = min(self.time + seconds, self.end), []
        wake, changed.notify_all = changed.notify_all, lambda: woken.append(True)
        while not woken and self.happens and self.happens[0][0] <= until:
            self.time, act = self.happens.pop(0)
            act()
        changed.notify_all = wake
        if not woken:
            self.time = until


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
