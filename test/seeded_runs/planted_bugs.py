# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults that the device has had, or might have: each is put back for a while, and must be found.

A planted bug replaces functions of the package by wrong ones; `PLANTED_BUGS` holds them by name.
"""

from contextlib import ExitStack, closing, contextmanager
from unittest.mock import patch

from mlmem import atomic_files, element, threads
from mlmem.errors import Refused
from mlmem.instrument import actuator
from mlmem.loop import loop, mailbox, timetable
from mlmem.loop.mailbox import Request
from mlmem_ros.bag import writer
from mlmem_ros.host import sessions, store, worker

PLANTED_BUGS = {
    'strain_is_left_on_at_the_end': [
        (loop.Loop, '_release_strain',
         lambda self: self._box.close(Refused(reason=loop.SHUTDOWN_MESSAGE))),
    ],
    'session_begun_within_a_tick': [
        (sessions, '_call_between_ticks', lambda loop, function: function()),
    ],
    'recording_not_synced': [(writer.BagWriter, '_sync_file', lambda self, finish: finish())],
    'file_left_open_after_an_error': [(atomic_files, 'close_quietly', lambda file: None)],
    'no_sync_before_the_rename': [(atomic_files.DurableFile, 'sync_file', lambda self: None)],
    'no_sync_after_the_rename': [(atomic_files, 'sync_directory', lambda path: None)],
    'who_waits_for_a_hanging_disk_is_not_told': [(worker.Worker, 'on_timer', lambda self: None)],
}  # fmt: skip
"""By what it is: where a function stands, its name, and the wrong one."""


@contextmanager
def plant(name):
    """Put a fault back for a while."""
    with ExitStack() as stack:
        for holder, replaced, function in PLANTED_BUGS[name]:
            stack.enter_context(patch.object(holder, replaced, function))
        yield


def _replace(holder, replaced, bug=None):
    """Register the decorated function in the place of another one, as the fault of its name."""

    def register(function):
        PLANTED_BUGS.setdefault(bug or function.__name__, []).append((holder, replaced, function))
        return function

    return register


def _resolve(answer, function):
    """Give an answer what a function returns or raises."""
    try:
        answer.set_result(function())
    except Exception as error:
        answer.set_exception(error)
    return answer


# --- the loop ----------------------------------------------------------------------------


@_replace(timetable.Timetable, 'count_deferred')
def division_by_zero_at_full_speed(self, late, box):
    at_once = self._at_once if self.period else self._batch  # also without a pace
    if at_once == 1 or not self._element.is_still:
        return 0
    ticks = -(self._element.ticks + 1) % at_once
    return min(ticks, max(0, int(late / self.period))) if box.commands else ticks


@_replace(loop.Loop, 'shut_down', bug='queue_cleared_between_look_and_pop')
def clear_queue_and_shut_down(self, *, shut_down=loop.Loop.shut_down):
    self._box.close(Refused(reason=loop.SHUTDOWN_MESSAGE))
    shut_down(self)


@_replace(mailbox.Mailbox, 'take_request', bug='queue_cleared_between_look_and_pop')
def look_and_pop(self, queue):
    if queue:
        threads.monotonic()
        request = queue.popleft()
        return request if request.take_up() else None
    return None


@_replace(mailbox.Mailbox, 'call')
def lost_wake_up(self, function, paused=None):
    request = Request(function)
    with self.changed:
        closed = self._closed
        self.paused = self.paused if paused is None else paused
        self.changed.notify_all()
    if closed is None:
        self.calls.append(request)
    else:
        request.refuse(closed)
    return request.answer


@_replace(mailbox.Mailbox, 'close')
def who_waits_at_the_end_is_forgotten(self, refusal):
    with self.changed:
        self._closed = self._closed or refusal
        for queue in (self.commands, self.calls, self.steps):
            queue.clear()


@_replace(actuator.Actuator, 'check')
def not_a_number_reaches_the_strain(self, strain, *, check=actuator.Actuator.check):
    if strain == strain:  # false for NaN alone
        check(self, strain)


@_replace(element.MemoryElement, 'apply')
def a_refused_command_forgets_the_reading(self, command, *, apply=element.MemoryElement.apply):
    if not self.procedure:
        self.forget_content('refused')
    return apply(self, command)


# --- the recording -----------------------------------------------------------------------


@_replace(sessions.Sessions, '_start_session')
def two_recordings_at_once(self, *given, start=sessions.Sessions._start_session):
    self.current = None
    return start(self, *given)


@_replace(sessions.Sessions, '_stop')
def assertion_when_nothing_is_recorded(self, *given, stop=sessions.Sessions._stop):
    assert self.current is not None
    return stop(self, *given)


@_replace(sessions.Sessions, 'stop')
def recorder_joined_in_the_executor(self, loop):
    return _resolve(threads.Future(), lambda: self._stop(loop.element, loop))


# --- the state file ----------------------------------------------------------------------


@_replace(atomic_files, 'write_atomically')
def state_written_in_place(path, text):
    flags = atomic_files.os.O_WRONLY | atomic_files.os.O_CREAT | atomic_files.os.O_TRUNC
    with closing(atomic_files.DurableFile(atomic_files.os.open(path, flags))) as file:
        file.write(text.encode())
        file.sync_file()
    atomic_files.sync_directory(path.parent)


@_replace(store.Store, 'resolve')
def answer_before_it_is_saved(self, request, element):
    request.resolve(request.outcome)
    if not element.procedure:
        self.save_state(element)


@_replace(store.Store, 'save_state')
def newer_state_overwritten_by_an_older_one(self, element):
    taken = store.snapshot.take_snapshot(element)
    return threads.run_in_thread(lambda: store.save_snapshot(self.path, taken))


@_replace(store.Store, 'on_timer')
def state_taken_within_a_tick(self, loop):
    self._worker.on_timer()
    if loop is not None and not loop.element.procedure:
        self._keep_if_idle(loop.element)


@_replace(worker.Worker, 'wait')
def the_end_waits_for_a_hanging_disk(self, seconds=None, *, wait=worker.Worker.wait):
    del seconds
    return wait(self, 1e6)


@_replace(worker.Worker, '_run')
def work_given_up_is_done_all_the_same(self):
    while self._jobs:
        _resolve(self._jobs[0].answer, self._jobs[0].work)
        with self._changed:
            self._jobs.popleft()
            self._changed.notify_all()
