# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Start and stop session files: one state machine, driven by one thread."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from mlmem import ErrorCode, Loop, MemoryElement, Refused, SettingsError

from ..bag.errors import BagError
from .settings import SessionPlan
from .worker import Overdue, ThrottledLog, Worker

if TYPE_CHECKING:
    from .recording import BagRecording, LoggedMessage, PreTriggerBuffer

T = TypeVar('T')


class Sessions:
    """Holds the one recording of an element.

    A worker thread serves requests one by one. It alone opens and closes files, and may hang on
    them. A recording begins and ends in the loop's thread, between two ticks.
    While there is none, a pre-trigger buffer may keep the last seconds: a recording then begins
    with them, and they are saved as a session if the device fails. Without one, it begins with
    the state that the device has, idle, once the bag is open.

    Attributes:
        current: The recording into a bag, or None.
        buffer: The pre-trigger buffer, or None without one; empty during a recording.
        lost: Whether anything that was recorded could not be written.
    """

    def __init__(self, log: ThrottledLog, now: Callable[[], int]) -> None:
        """Create it idle; `now` is in nanoseconds."""
        self.current: BagRecording | None = None
        self.buffer: PreTriggerBuffer | None = None
        self._log = log
        self._now = now
        self._worker = Worker('mlmem-sessions', log)
        self.lost = False

    def keep(self, plan: SessionPlan, element: MemoryElement) -> None:
        """Keep the last seconds of a device from now on; call it before time runs.

        Raises:
            BagError: Packages that are needed to record are missing.
        """
        buffer = _import_recorder().PreTriggerBuffer(plan, self._log, self._now, element)
        if self.current is not None:
            buffer.clear()
        self.buffer = buffer

    def begin(self, plan: SessionPlan, element: MemoryElement) -> None:
        """Begin a recording before time runs, in `record.path`; otherwise like `start`.

        Raises:
            BagError: It cannot be written.
            SettingsError: The path leads out of `files.root`.
            Overdue: The disk does not answer.
        """
        self._worker.do_and_wait(
            'starting the recording', lambda: self._start_session(plan, element, None)
        )

    def start(self, plan: SessionPlan, loop: Loop) -> Future[Path]:
        """Begin a recording while time runs.

        Returns:
            The path of the new bag, which begins with the last seconds or the state; `Refused`
            if a session is being recorded, or a procedure runs and no last seconds are kept; else
            what `begin` raises. If the path exists, the time is added to it.
        """
        return self._worker.do(
            'starting the recording', lambda: self._start_session(plan, loop.element, loop)
        )

    def stop(self, loop: Loop) -> Future[Path]:
        """End the recording while time runs.

        Returns:
            The path of the bag, once it is closed; `Refused` if nothing is being recorded,
            `BagError` if not all could be written.
        """
        return self._worker.do('closing the recording', lambda: self._stop(loop.element, loop))

    def on_timer(self) -> None:
        """Answer requests that have waited too long for the disk; call it once a second."""
        self._worker.on_timer()

    def close(self, element: MemoryElement | None) -> None:
        """End any recording when time has stopped; waits, but not for long.

        Args:
            element: The element; None if it has failed. Its last seconds are then saved, without a
                final hash, since the commands of the failed tick are not recorded.
        """
        try:
            self._worker.do_and_wait('closing the recording', lambda: self._close_session(element))
        except Refused:  # nothing is being recorded
            pass
        except BagError:  # logged when it occurred
            self.lost = True
        except Overdue as error:
            self._log.error(str(error))
            self.lost = True

    # --- in the worker's thread ----------------------------------------------------------

    def _start_session(
        self, plan: SessionPlan, element: MemoryElement | None, loop: Loop | None
    ) -> Path:
        if self.current is not None:
            if self.current.error is None:
                why = f'busy: recording into {self.current.path}'
                raise Refused(ErrorCode.BUSY, reason=why)
            with suppress(BagError):  # logged when it occurred
                self._stop(None, loop)
        recorder = _import_recorder()
        writer = recorder.open_bag(plan)

        def attach_recording(before: list[LoggedMessage]) -> None:
            self.current = recorder.BagRecording(plan, self._log, self._now, writer, before)
            if self.buffer is not None:
                self.buffer.clear()

        def begin_session() -> None:
            before = [] if self.buffer is None else self.buffer.list_messages()
            if not before and element is None:
                raise Refused(ErrorCode.CONFLICT, reason='there is no state to begin with')
            before = before or [recorder.build_header(plan, element, self._now)]
            self._worker.unless_given_up(lambda: attach_recording(before))

        try:
            _call_between_ticks(loop, begin_session)
        except Refused:  # the loop has ended, the device is not idle, or it is too late
            writer.close()
            shutil.rmtree(writer.path, ignore_errors=True)
            raise
        return cast('Path', writer.path)

    def _stop(self, element: MemoryElement | None, loop: Loop | None) -> Path:
        recording = self.current
        if recording is None:
            raise Refused(ErrorCode.CONFLICT, reason='nothing is being recorded')

        def end_session() -> None:
            self.current = None
            if element is not None:
                recording.record_hash(element)

        _call_between_ticks(loop, end_session)
        recording.close()  # writes what is queued; waits for the disk
        if recording.error is not None:
            self.lost = True
            raise recording.error
        self._log.info(
            f'session closed: {recording.messages} messages, {recording.size / 1e6:.2f} MB, '
            f'{recording.dropped} dropped, in {recording.path}'
        )
        return recording.path

    def _close_session(self, element: MemoryElement | None) -> Path:
        try:
            if element is None and self.buffer is not None and self.current is None:
                self._save_last_seconds(self.buffer.plan)
            return self._stop(element, None)
        finally:
            self.buffer = None

    def _save_last_seconds(self, plan: SessionPlan) -> None:
        """Save the last seconds of a failed device as a session."""
        try:
            self._start_session(plan, None, None)
        except (BagError, SettingsError) as error:
            self._log.error(f'the last seconds are lost: {error}')
            raise BagError(str(error)) from error


def _import_recorder() -> Any:
    """Import what records, and only that needs the packages for it."""
    try:
        from . import recording
    except ModuleNotFoundError as error:
        from ..packages import describe_missing

        raise BagError(f'Cannot record: {describe_missing(error)}') from error
    return recording


def _call_between_ticks(loop: Loop | None, function: Callable[[], T]) -> T:
    """Call a function between ticks: in the loop's thread, if there is one."""
    return function() if loop is None else loop.call(function).result()
