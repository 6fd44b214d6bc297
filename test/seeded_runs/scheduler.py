# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Threads that take turns as a seed decides, on a virtual clock: a run is reproduced by its
number.

Every task is a greenlet. It may hand over to another one wherever a thread of the system could be
interrupted to some effect: when it takes or releases a lock, waits, notifies, reads the clock or
calls the disk. Time passes when no task can run, and a little with every reading of the clock.
"""

import random
from collections import deque
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import count

import greenlet

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
