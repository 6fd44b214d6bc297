# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Threads that take turns as a seed decides, on a virtual clock: a run is reproduced by its
number.

Every task is a greenlet. It may hand over to another one wherever a thread of the system could be
interrupted to some effect: when it takes or releases a lock, waits, notifies, reads the clock or
calls the disk. Time passes when no task can run, and a little with every reading of the clock.
"""

import concurrent.futures
import random
import sys
from collections import deque
from contextlib import contextmanager
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import count
from unittest.mock import patch

import greenlet

from mlmem import threads

EPOCH_S = 1.8e9
"""Time of day when the clock of a world would show 0."""

MAX_HANDOVERS = 2_000_000
"""Hand-overs after which a world counts as endless."""


class Killed(greenlet.GreenletExit):
    """The process was killed: raised in each of its tasks; nobody may catch it."""


class Deadlock(Exception):
    """No task can run and no time-out is pending; the message says who waits for what."""


class Endless(Exception):
    """The tasks hand over for ever."""


@dataclass(eq=False, slots=True)
class Task:
    """A thread of control.

    Attributes:
        name: Name in the history.
        outside: Whether it is not part of the process that may be killed.
        ended: Whether it has finished or was killed.
        waits_for: What it waits for, as a text or an object with a name.
        joiners: Tasks that wait for its end.
        turn: How often it has slept: a timer of an earlier sleep is void.
    """

    name: str
    outside: bool
    greenlet: object = None
    ended: bool = False
    waits_for: str = ''
    joiners: list = field(default_factory=list)
    asleep: bool = False
    turn: int = 0
    woken: bool = False


class Scheduler:
    """Runs tasks, one at a time.

    Attributes:
        now: The time in seconds.
        current: The running task; None outside of all.
        tasks: All tasks started so far.
        history: The last hand-overs: time, task, and what it was about to do.
        handovers: Number of hand-overs so far.
        failures: Exceptions that reached nobody, with their task.
        locks: All locks of the process.
        futures: All futures of the process.
        crash_at: Number of the hand-over at which the process is killed, or None.
        crashed: Whether it was killed.
    """

    def __init__(self, seed):
        """Prepare a world without tasks, calm or wild as the seed chooses."""
        self.random = random.Random(seed)
        self._dice = self.random.random
        self._handover_share = self.random.choice((0.02, 0.1, 0.4, 0.9))
        self.now = 1000.0
        self.current = None
        self.tasks = []
        self.history = deque(maxlen=300)
        self.handovers = 0
        self.failures = []
        self.locks = []
        self.futures = []
        self.crash_at = None
        self.crashed = False
        self._dying = False
        self._ready = []
        self._due = []
        self._number = count()
        self._root = greenlet.getcurrent()

    # --- from outside --------------------------------------------------------------------

    def spawn(self, function, name, *, outside=False):
        """Start a task; it runs when its turn comes."""
        task = Task(name, outside)

        def body():
            try:
                function()
            except Killed:
                pass
            except Exception as failure:
                if not task.ended:  # else it was killed, and tripped on its way out
                    self.failures.append((name, failure))
            task.ended = True
            for joiner in task.joiners:
                self.wake(joiner)

        task.greenlet = greenlet.greenlet(body, self._root)
        self.tasks.append(task)
        self._ready.append(task)
        return task

    def run(self, until):
        """Run the tasks until one of them has ended.

        Raises:
            Deadlock: It cannot.
            Endless: It does not.
        """
        while not until.ended:
            if self._dying or self._is_crash_due():
                self._kill()
                continue
            if self.handovers > MAX_HANDOVERS:
                raise Endless(f'after {MAX_HANDOVERS} hand-overs; {self._describe_tasks()}')
            if not self._wake_due_tasks():
                raise Deadlock(self._describe_tasks())
            self._choose_task().greenlet.switch()
            self.current = None

    def kill(self):
        """Kill all tasks of the process, wherever they stand, and forget what they held."""
        if self.current is None:
            self._kill()
        else:
            self._dying = True
            self._ready.append(self.current)
            self._root.switch()

    def _kill(self):
        if self._is_crash_due():
            self.crash_at = None
            self.crashed = True
            self.add_note('crash')
        self._dying = False
        for task in self.tasks:
            if not (task.outside or task.ended):
                self.current = task
                task.ended = True  # what it still does on its way out has no effect
                task.greenlet.throw(Killed)
        self.current = None
        self.tasks = [task for task in self.tasks if not task.ended]
        self._ready = [task for task in self._ready if not task.ended]
        self.locks.clear()
        self.futures.clear()

    def list_leftovers(self):
        """Return what the process has left behind: threads, held locks, unanswered futures."""
        return [
            *(
                f'thread {task.name}, {_describe_state(task)}'
                for task in self._list_alive()
                if not task.outside
            ),
            *(f'{lock} held by {lock.owner.name}' for lock in self.locks if lock.owner),
            *(f'{future} pending' for future in self.futures if not future.done()),
        ]

    def _is_crash_due(self):
        return self.crash_at is not None and self.handovers >= self.crash_at

    def _list_alive(self):
        return [task for task in self.tasks if not task.ended]

    def _describe_tasks(self):
        return '; '.join(f'{task.name} {_describe_state(task)}' for task in self._list_alive())

    # --- from within a task --------------------------------------------------------------

    def hand_over(self, what):
        """Possibly let another task run."""
        task = self.current
        if task is None or task.ended:  # outside of all, or on the way out of a killed process
            return
        self.history.append((self.now, task.name, what))
        self.handovers += 1
        if self._is_crash_due():
            self._ready.append(task)
            self._root.switch()
        elif self._dice() < self._handover_share:
            self._ready.append(task)
            self._run_next_task()

    def block(self, what, seconds=None):
        """Sleep until `wake`, or for a time; return whether it was `wake`."""
        task = self.current
        if task is None:
            raise Deadlock(f'who is outside of all tasks cannot wait for {what}')
        if task.ended:
            raise Killed
        self.history.append((self.now, task.name, ('sleep', what)))
        self.handovers += 1
        task.waits_for = what
        task.asleep, task.woken = True, False
        if seconds is not None:
            due = self.now + max(0.0, seconds)
            heappush(self._due, (due, next(self._number), task, task.turn))
        self._run_next_task()
        task.waits_for = ''
        return task.woken

    def wake(self, task):
        """Wake a sleeping task, or one whose time has just run out."""
        task.woken = True
        if task.asleep and not task.ended:
            self._make_ready(task)

    def _make_ready(self, task):
        task.asleep = False
        task.turn += 1
        self._ready.append(task)

    def sleep(self, seconds):
        """Do nothing for a time."""
        self.block('time to pass', seconds)

    def monotonic(self):
        """Return the time; the reading takes a moment."""
        self.hand_over('clock')
        self.now += 1e-6
        return self.now

    def time(self):
        """Return the time of day, in seconds of the epoch."""
        return EPOCH_S + self.monotonic()

    def add_note(self, what):
        """Add a line to the history."""
        name = self.current.name if self.current else '-'
        self.history.append((self.now, name, what))

    def _run_next_task(self):
        """Run a task that can, chosen by the seed."""
        me = self.current
        if self.handovers > MAX_HANDOVERS or not self._wake_due_tasks():
            self._root.switch()  # which says so
        elif (task := self._choose_task()) is not me:
            task.greenlet.switch()

    def _wake_due_tasks(self):
        """Wake tasks whose time has come, and return whether any task can run."""
        due = self._due
        while due and (due[0][0] <= self.now or not self._ready):
            time, _, task, turn = heappop(due)
            if task.turn == turn and not task.ended:
                self.now = max(self.now, time)
                self._make_ready(task)
        return bool(self._ready)

    def _choose_task(self):
        ready = self._ready
        index = int(self._dice() * len(ready))
        ready[index], ready[-1] = ready[-1], ready[index]
        self.current = task = ready.pop()
        return task


def _describe_state(task):
    return f'waits for {task.waits_for}' if task.waits_for else 'can run'


# --- the contents of `mlmem.threads`, made of these tasks --------------------------------------

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
