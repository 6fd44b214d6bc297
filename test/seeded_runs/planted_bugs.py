# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults that the device has had, or might have: each is put back for a while, and must be found.

A planted bug replaces functions of the package by wrong ones; `PLANTED_BUGS` holds them by name.
"""

from contextlib import ExitStack, contextmanager
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


def _register(*replaced):
    """Register a fault that is made of the functions that it replaces."""

    def enter(fault):
        wrong = fault(*(getattr(holder, name) for holder, name in replaced))
        wrong = wrong if isinstance(wrong, tuple) else (wrong,)
        PLANTED_BUGS[fault.__name__] = [
            (*place, function) for place, function in zip(replaced, wrong, strict=True)
        ]
        return fault

    return enter


# --- the loop ----------------------------------------------------------------------------


@_register((timetable.Timetable, 'count_deferred'))
def division_by_zero_at_full_speed(_):
    def deferred(self, late, box):
        at_once = self._at_once if self.period else self._batch  # also without a pace
        if at_once == 1 or not self._element.is_still:
            return 0
        ticks = -(self._element.ticks + 1) % at_once
        return min(ticks, max(0, int(late / self.period))) if box.commands else ticks

    return deferred


@_register((loop.Loop, 'shut_down'), (mailbox.Mailbox, 'take_request'))
def queue_cleared_between_look_and_pop(end, _):
    def hasty_end(self):
        self._box.close(Refused(reason=loop.SHUTDOWN_MESSAGE))
        end(self)

    def take(self, queue):
        if queue:
            threads.monotonic()
            request = queue.popleft()
            return request if request.take_up() else None
        return None

    return hasty_end, take


@_register((mailbox.Mailbox, 'call'))
def lost_wake_up(_):
    def call(self, function, paused=None):
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

    return call


@_register((mailbox.Mailbox, 'close'))
def who_waits_at_the_end_is_forgotten(_):
    def close(self, refusal):
        with self.changed:
            self._closed = self._closed or refusal
            for queue in (self.commands, self.calls, self.steps):
                queue.clear()

    return close


@_register((actuator.Actuator, 'check'))
def not_a_number_reaches_the_strain(check):
    def lenient(self, strain):
        if strain == strain:  # false for NaN alone
            check(self, strain)

    return lenient


@_register((element.MemoryElement, 'apply'))
def a_refused_command_forgets_the_reading(apply):
    def forgetful(self, command):
        if not self.procedure:
            self.forget_content('refused')
        return apply(self, command)

    return forgetful


# --- the recording -----------------------------------------------------------------------


@_register((sessions.Sessions, '_start_session'))
def two_recordings_at_once(start):
    def unguarded(self, *given):
        self.current = None
        return start(self, *given)

    return unguarded


@_register((sessions.Sessions, '_stop'))
def assertion_when_nothing_is_recorded(stop):
    def asserting(self, *given):
        assert self.current is not None
        return stop(self, *given)

    return asserting


@_register((sessions.Sessions, 'stop'))
def recorder_joined_in_the_executor(_):
    def stop(self, loop):
        answer = threads.Future()
        try:
            answer.set_result(self._stop(loop.element, loop))
        except Exception as error:
            answer.set_exception(error)
        return answer

    return stop


# --- the state file ----------------------------------------------------------------------


@_register((atomic_files, 'write_atomically'))
def state_written_in_place(_):
    def write(path, text):
        flags = atomic_files.os.O_WRONLY | atomic_files.os.O_CREAT | atomic_files.os.O_TRUNC
        file = atomic_files.DurableFile(atomic_files.os.open(path, flags))
        try:
            file.write(text.encode())
            file.sync_file()
        finally:
            file.close()
        atomic_files.sync_directory(path.parent)

    return write


@_register((store.Store, 'resolve'))
def answer_before_it_is_saved(resolve):
    def hasty(self, request, element):
        request.resolve(request.outcome)
        if not element.procedure:
            self.save_state(element)

    return hasty


@_register((store.Store, 'save_state'))
def newer_state_overwritten_by_an_older_one(keep):
    def keep_at_once(self, element):
        taken, saved = store.snapshot.take_snapshot(element), threads.Future()

        def run():
            try:
                saved.set_result(store.save_snapshot(self.path, taken))
            except Exception as error:
                saved.set_exception(error)

        threads.Thread(target=run, name='mlmem-store', daemon=True).start()
        return saved

    return keep_at_once


@_register((store.Store, 'on_timer'))
def state_taken_within_a_tick(_):
    def on_timer(self, loop):
        self._worker.on_timer()
        if loop is not None and not loop.element.procedure:
            self._keep_if_idle(loop.element)

    return on_timer


@_register((worker.Worker, 'wait'))
def the_end_waits_for_a_hanging_disk(wait):
    return lambda self, seconds=None: wait(self, 1e6)


@_register((worker.Worker, '_run'))
def work_given_up_is_done_all_the_same(_):
    def run(self):
        while self._jobs:
            job = self._jobs[0]
            try:
                result, error = job.work(), None
            except Exception as failure:
                result, error = None, failure
            if error is None:
                job.answer.set_result(result)
            else:
                job.answer.set_exception(error)
            with self._changed:
                self._jobs.popleft()
                self._changed.notify_all()

    return run
