# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Work that waits for the disk, in a thread of its own: it may hang, and nobody hangs with it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from .. import threads
from ..device import Refused
from .errors import REFUSALS, Overdue
from .journal import Journal

T = TypeVar('T')

PATIENCE = 10.0
"""Seconds after which somebody who waits for the disk is told that it does not answer."""


class _Job:
    def __init__(self, what: str, work: Callable[[], Any], anyway: bool) -> None:
        self.what = what
        self.work = work
        self.anyway = anyway
        self.answer: Future[Any] = threads.Future()
        self.answer.set_running_or_notify_cancel()  # what is asked for is not withdrawn
        self.deadline = threads.monotonic() + PATIENCE
        self.answered = False


class Worker:
    """Does one job after the other, in a thread that lives while there are any."""

    def __init__(self, name: str, journal: Journal) -> None:
        """Have nothing to do.

        Args:
            name: Name of the thread.
            journal: Where defects are told.
        """
        self._name = name
        self._journal = journal
        self._changed = threads.Condition()
        self._jobs: deque[_Job] = deque()  # the first is being done

    def do(self, what: str, work: Callable[[], T], anyway: bool = False) -> Future[T]:
        """Have something done after all that was asked for before.

        Args:
            what: What it is, for messages: "saving the state in ...".
            work: Called in the worker's thread.
            anyway: Whether it is done even where nobody waits for it any more.

        Returns:
            What the work returns or raises; `Overdue` where it takes longer than `PATIENCE`: work
            that has not begun by then is left undone.
        """
        job = _Job(what, work, anyway)
        with self._changed:
            self._jobs.append(job)
            alone = len(self._jobs) == 1
        if alone:
            threads.Thread(target=self._run, name=self._name, daemon=True).start()
        return job.answer

    def done(self, what: str, work: Callable[[], T]) -> T:
        """Do something in the worker's thread and wait for it, but not for long.

        Raises:
            Overdue: It takes longer than `PATIENCE`.
            Whatever the work raises.
        """
        answer = self.do(what, work)
        self.wait()
        return answer.result()

    def tend(self) -> None:
        """Answer who has waited too long; to be called about once a second."""
        now = threads.monotonic()
        with self._changed:
            late = [job for job in self._jobs if now >= job.deadline and not job.answered]
            for job in late:
                job.answered = True
        for job in late:
            job.answer.set_exception(Overdue(job.what, PATIENCE))

    def wait(self, seconds: float = PATIENCE) -> bool:
        """Wait until there is nothing to do any more, or for a time; return whether there is not.

        Whoever still waits for an answer then is told that it does not come.
        """
        with self._changed:
            done = self._changed.wait_for(lambda: not self._jobs, seconds)
            late = [job for job in self._jobs if not job.answered]
            for job in late:
                job.answered = True
        for job in late:
            job.answer.set_exception(Overdue(job.what, seconds))
        return done

    def unless_given_up(self, step: Callable[[], T]) -> T:
        """Take a step of the work that is being done, that takes no time, if it is still wanted.

        Raises:
            Refused: Whoever asked for the work has been told that it is overdue.
        """
        with self._changed:
            job = self._jobs[0]
            if job.answered:
                raise Refused(f'{job.what} came too late')
            return step()

    def _run(self) -> None:
        while True:
            job = self._jobs[0]
            result, error = None, None
            try:
                if job.anyway or not job.answered:
                    result = job.work()
            except Exception as failure:
                error = failure
                if not isinstance(failure, REFUSALS):
                    self._journal.exception(job.what, failure)
            with self._changed:
                answered, job.answered = job.answered, True
            if not answered:
                if error is None:
                    job.answer.set_result(result)
                else:
                    job.answer.set_exception(error)
            with self._changed:
                self._jobs.popleft()
                self._changed.notify_all()
                if not self._jobs:
                    return
