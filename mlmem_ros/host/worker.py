# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What serves the whole host: a log for people, without floods and overlong lines; and a thread
of its own for disk work, which may hang without hanging its callers.
"""

from __future__ import annotations

import math
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, TypeVar

from mlmem import DesignError, DriverError, Refused, SettingsError, StateError, threads
from mlmem.schema import make_printable

from ..bag.errors import BagError

WriteLine = Callable[[str, str], object]
"""Writes a line to a log, given its severity, INFO, WARN or ERROR, and its text."""


class ThrottledLog:
    """Writes to a log from any thread, and catches exceptions that nobody else handles.

    Attributes:
        caught: How many of these there were.
        refusals: How many requests and messages were refused.
    """

    def __init__(self, write: WriteLine) -> None:
        self.caught = self.refusals = 0
        self._write = write
        self._lock = threads.Lock()
        self._allowed: dict[str, tuple[float, float]] = {}  # lines remaining, and when computed
        self._withheld: dict[str, int] = {}

    def info(self, text: str, about: str = '') -> None:
        """Log an event; a flood of lines about one subject is thinned to one per second."""
        self._write_thinned('INFO', about, text)

    def warning(self, text: str, about: str = '') -> None:
        """Log an oddity; floods are thinned as in `info`."""
        self._write_thinned('WARN', about, text)

    def error(self, text: str) -> None:
        """Log a failure."""
        self._write_thinned('ERROR', '', text)

    def refused(self, what: str, why: object) -> None:
        """Count and log a refusal; floods are thinned as in `info`."""
        with self._lock:
            self.refusals += 1
        self.warning(f'{what} refused: {why}', what)

    def exception(self, where: str, error: BaseException) -> None:
        """Log a fault in the software: an unexpected exception, with its traceback."""
        with self._lock:
            self.caught += 1
        self._write_thinned(
            'ERROR', where, f'{where} failed; this is a fault in the software', error
        )

    def log_cause(self, error: BaseException) -> None:
        """Log the traceback of what caused an expected error, if that was unexpected."""
        cause = error.__cause__
        if cause is None or isinstance(cause, (OSError, ImportError)):
            return
        kinds = f'{type(error).__name__} of {type(cause).__name__}'  # texts are without number
        self._write_thinned('ERROR', kinds, str(error), cause)

    @contextmanager
    def guard_errors(self, where: str) -> Iterator[None]:
        """Catch and log every exception of the body."""
        try:
            yield
        except Exception as error:
            self.exception(where, error)

    def _write_thinned(
        self, severity: str, about: str, text: str, error: BaseException | None = None
    ) -> None:
        """Write a line, with the traceback of an error, unless there are too many on a subject."""
        if (since := self._withhold_note(about)) is not None:
            trace = ':\n' + ''.join(traceback.format_exception(error)) if error else ''
            line = make_printable(text, 500)  # characters; a longer one loses its middle
            self._write(severity, line + since + trace)

    def _withhold_note(self, key: str) -> str | None:
        """Return a note on how many lines were withheld, or None to withhold this one too."""
        if not key:
            return ''
        with self._lock:
            now = threads.monotonic()
            burst = 10  # lines about one subject at once; then one a second
            allowed, counted = self._allowed.get(key, (burst, now))
            allowed = min(burst, allowed + now - counted)
            if allowed < 1.0:
                self._allowed[key] = allowed, now
                self._withheld[key] = self._withheld.get(key, 0) + 1
                return None
            self._allowed[key] = allowed - 1.0, now
            withheld = self._withheld.pop(key, 0)
        return f' (and {withheld} more since the last line)' if withheld else ''


class Overdue(Exception):
    """The disk does not answer: the work may or may not still complete."""

    def __init__(self, what: str, seconds: float) -> None:
        super().__init__(f'{what} takes longer than {seconds:g} s: the disk does not answer')


REFUSALS = (Refused, DriverError, DesignError, SettingsError, StateError, BagError, Overdue)
"""Expected errors, with a message for the user; any other is a fault in the software."""


T = TypeVar('T')

WORK_TIMEOUT_S = 10.0
"""Seconds after which callers learn that the disk does not answer."""


class _Job:
    def __init__(self, what: str, work: Callable[[], Any], anyway: bool) -> None:
        self.what = what
        self.work = work
        self.anyway = anyway
        self.answer: Future[Any] = threads.Future()
        self.answer.set_running_or_notify_cancel()  # a job cannot be cancelled
        self.deadline = threads.monotonic() + WORK_TIMEOUT_S
        self.answered = False


class Worker:
    """Does one job after another, in a thread that lives while there are any."""

    def __init__(self, name: str, log: ThrottledLog) -> None:
        self._name = name
        self._log = log
        self._changed = threads.Condition()
        self._jobs: deque[_Job] = deque()  # the first is in progress

    def do(self, what: str, work: Callable[[], T], anyway: bool = False) -> Future[T]:
        """Queue a job.

        Args:
            what: Description for messages, such as "saving the state in ...".
            anyway: Whether to do it even if nobody waits for it any more.

        Returns:
            What the work returns or raises; `Overdue` if it takes longer than `WORK_TIMEOUT_S`.
            Work that has not begun by then is dropped.
        """
        job = _Job(what, work, anyway)
        with self._changed:
            self._jobs.append(job)
            alone = len(self._jobs) == 1
        if alone:
            threads.Thread(target=self._run, name=self._name, daemon=True).start()
        return job.answer

    def do_and_wait(self, what: str, work: Callable[[], T]) -> T:
        """Do a job in the worker's thread and wait for it, but not for long.

        Raises:
            Overdue: It takes longer than `WORK_TIMEOUT_S`.
            What the work raises.
        """
        answer = self.do(what, work)
        self.wait()
        return answer.result()

    def on_timer(self) -> None:
        """Answer callers who have waited too long; call it once a second."""
        self._give_up_jobs(threads.monotonic(), WORK_TIMEOUT_S)

    def wait(self, seconds: float = WORK_TIMEOUT_S) -> bool:
        """Wait until all jobs are done, or for a time; return whether they are.

        Callers who are still waiting then get `Overdue`.
        """
        with self._changed:
            done = self._changed.wait_for(lambda: not self._jobs, seconds)
        self._give_up_jobs(math.inf, seconds)
        return done

    def unless_given_up(self, step: Callable[[], T]) -> T:
        """Do a quick step of the current job, if somebody still waits for it.

        Raises:
            Refused: Its caller has got `Overdue`.
        """
        with self._changed:
            job = self._jobs[0]
            if job.answered:
                raise Refused(reason=f'{job.what} came too late')
            return step()

    def _give_up_jobs(self, now: float, seconds: float) -> None:
        """Answer callers whose deadline has passed, after they have waited for a time."""
        with self._changed:
            late = [job for job in self._jobs if now >= job.deadline and not job.answered]
            for job in late:
                job.answered = True
        for job in late:  # without the lock, for what it calls
            job.answer.set_exception(Overdue(job.what, seconds))

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
                    self._log.exception(job.what, failure)
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
