# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The contents of `mlmem.threads`, made of the tasks of a scheduler."""

import concurrent.futures
import sys
from contextlib import contextmanager
from unittest.mock import patch

from mlmem import threads

_SCHEDULERS = []
"""The scheduler under whatever is made now, as its last entry."""


@contextmanager
def use_scheduler(scheduler):
    """Run all threads, locks, futures and clocks created meanwhile under a scheduler."""
    ours = {kind.__name__: kind for kind in (Thread, Lock, Condition, Future)}
    clocks = {'monotonic': scheduler.monotonic, 'time': scheduler.time}
    assert {*ours, *clocks, 'run_in_thread'} == set(threads.__all__)  # it is made of these
    _SCHEDULERS.append(scheduler)
    try:
        with patch.multiple(threads, **ours, **clocks):
            yield
    finally:
        _SCHEDULERS.pop()


def _locate_caller():
    """Return where in the source something is created, as its name."""
    frame = sys._getframe(2)
    return f'{frame.f_code.co_filename.rpartition("/")[2]}:{frame.f_lineno}'


class Lock:
    """Like `threading.Lock` or `RLock`; `owner` is the task that holds it, or None."""

    def __init__(self, *, reentrant=False, name=''):
        self._scheduler = _SCHEDULERS[-1]
        self._reentrant = reentrant
        self._name = name or f'lock {_locate_caller()}'
        self.owner = None
        self._depth = 0
        self._waiting = []
        self._scheduler.locks.append(self)

    def __repr__(self):
        return self._name

    def acquire(self):
        scheduler = self._scheduler
        scheduler.hand_over(('acquire', self._name))
        me = scheduler.current or 'outside'
        while self.owner is not None and not (self._reentrant and self.owner is me):
            self._waiting.append(me)
            scheduler.block(f'{self._name} held by {self.owner.name}')
        self.owner = me
        self._depth += 1

    def release(self):
        self.release_lock()
        self._scheduler.hand_over(('release', self._name))

    def release_lock(self):
        """Release with no hand-over."""
        me = self._scheduler.current
        if me is not None and me.ended:
            return  # on the way out of a killed process, it may not even be held
        if self.owner is None:
            raise RuntimeError(f'release of {self._name}, which is not held')
        self._depth -= 1
        if not self._depth:
            self.owner = None
            if self._waiting:
                self._scheduler.wake(self._waiting.pop(0))

    def __enter__(self):
        self.acquire()

    def __exit__(self, *_):
        self.release()


class Condition(Lock):
    """Like `threading.Condition`."""

    def __init__(self, *, name=''):
        super().__init__(reentrant=True, name=name or f'condition {_locate_caller()}')
        self._waiters = []

    def wait(self, timeout=None):
        scheduler, me = self._scheduler, self._scheduler.current
        if self.owner is not me:
            raise RuntimeError(f'wait on {self._name}, which is not held')
        depth, self._depth = self._depth, 1
        self._waiters.append(me)
        self.release_lock()
        woken = scheduler.block(self._name, timeout)
        if not woken:
            self._waiters.remove(me)
        self.acquire()
        self._depth = depth
        return woken

    def wait_for(self, predicate, timeout=None):
        end = None if timeout is None else self._scheduler.now + timeout
        while not (result := predicate()):
            remaining = None if end is None else end - self._scheduler.now
            if remaining is not None and remaining <= 0.0:
                break
            self.wait(remaining)
        return result

    def notify(self, n=1):
        # Who notifies holds the lock, or what it has changed may be missed.
        if self.owner is None:
            raise RuntimeError(f'notify of {self._name}, which is not held')
        for _ in range(min(n, len(self._waiters))):
            self._scheduler.wake(self._waiters.pop(0))
        self._scheduler.hand_over(('notify', self._name))

    def notify_all(self):
        self.notify(len(self._waiters))


class Future(concurrent.futures.Future):
    """Like `concurrent.futures.Future`; an exception of a callback is a finding."""

    def __init__(self):
        super().__init__()
        self._scheduler = _SCHEDULERS[-1]
        self._name = f'future {_locate_caller()}'
        self._condition = Condition(name=self._name)
        self._scheduler.futures.append(self)

    def __repr__(self):
        return f'{self._name} {self._state.lower()}'

    def add_done_callback(self, function):
        def report_failure(future):
            try:
                function(future)
            except Exception as failure:
                self._scheduler.failures.append((f'callback of {self._name}', failure))

        super().add_done_callback(report_failure)


class Thread:
    """Like `threading.Thread`."""

    def __init__(self, target, name, **_):
        self._scheduler = _SCHEDULERS[-1]
        self._begin_call, self.name = target, name
        self._task = None

    def start(self):
        self._task = self._scheduler.spawn(self._begin_call, self.name)
        self._scheduler.hand_over(('start', self.name))

    def is_alive(self):
        return self._task is not None and not self._task.ended

    def join(self, timeout=None):
        scheduler, task = self._scheduler, self._task
        scheduler.hand_over(('join', self.name))
        if task.ended:
            return
        task.joiners.append(scheduler.current)
        if not scheduler.block(f'the end of {self.name}', timeout):
            task.joiners.remove(scheduler.current)
