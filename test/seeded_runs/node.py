# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node without ROS: an executor that runs one callback at a time, and the life cycle."""

from collections import deque

from mlmem import threads
from mlmem_ros.host import REFUSALS

TRANSITION_NAMES = {
    'configure': ('unconfigured', 'inactive'),
    'activate': ('inactive', 'active'),
    'deactivate': ('active', 'inactive'),
    'cleanup': ('inactive', 'unconfigured'),
}
"""Transitions: from which state, and to which."""

TIMER_PERIOD_S = 1.0
"""Seconds between two looks at disks and intervals."""


class Executor:
    """Runs callbacks one after the other, and tends the host in between.

    Attributes:
        longest: Name and seconds of the callback that took longest.
    """

    def __init__(self, scheduler, on_timer, failed):
        """Begin, with nothing to do.

        Args:
            scheduler: The scheduler under which it runs.
            on_timer: Called every `TIMER_PERIOD_S` seconds.
            failed: Called with the name and the exception of a callback that raised.
        """
        self.longest = '', 0.0
        self._on_timer = on_timer
        self._failed = failed
        self._waiting = deque()
        self._ending = False
        self._idle = False
        self._scheduler = scheduler
        self.task = scheduler.spawn(self._run_callbacks, 'executor')

    def post(self, name, callback):
        """Queue a callback; any thread may call."""
        self._waiting.append((name, callback))
        self._make_ready()

    def end(self):
        """Run no more callbacks than those that wait."""
        self._ending = True
        self._make_ready()

    def _make_ready(self):
        if self._idle:  # and does not wait for something within a callback
            self._scheduler.wake(self.task)

    def _run_callbacks(self):
        due = threads.monotonic() + TIMER_PERIOD_S
        while (turn := self._take_next(due)) is not None:
            name, callback = turn
            begun = threads.monotonic()
            try:
                callback()
            except Exception as failure:
                self._failed(name, failure)
            took = threads.monotonic() - begun
            self.longest = max(self.longest, (name, took), key=lambda pair: pair[1])
            if name == 'on_timer':
                due = threads.monotonic() + TIMER_PERIOD_S

    def _take_next(self, due):
        while not self._waiting:
            if self._ending:
                return None
            remaining = due - self._scheduler.now
            self._idle = remaining > 0.0
            woken = self._idle and self._scheduler.block('something to do', remaining)
            self._idle = False
            if not woken:
                return 'on_timer', self._on_timer
        return self._waiting.popleft()


class Node:
    """The life cycle of a managed node around a host, as rclpy drives it.

    Attributes:
        state: Of the life cycle.
    """

    def __init__(self, host, activate, configured):
        """Start unconfigured.

        Args:
            activate: Activates it.
            configured: Its configuration.
        """
        self.host = host
        self.state = 'unconfigured'
        self._work = {
            'configure': lambda: host.adopt_device(host.prepare_device(configured)),
            'activate': activate,
            'deactivate': host.deactivate,
            'cleanup': host.release_device,
        }

    def make_transition(self, name):
        """Make a transition; return None, or why it failed or was refused."""
        begins, ends = TRANSITION_NAMES[name]
        if self.state != begins:
            return f'{name} is refused while {self.state}'
        try:
            self._work[name]()
        except REFUSALS as refusal:
            if self.host.failure is not None:
                self._fail_host()
            return str(refusal)
        except Exception:
            self._fail_host()
            raise
        self.state = ends
        return None

    def leave_on_failure(self):
        """Leave the active state if the device has failed."""
        if self.host.failure is not None:
            self.make_transition('deactivate')

    def _fail_host(self):
        self.state = 'unconfigured'
        self.host.release_failed()
