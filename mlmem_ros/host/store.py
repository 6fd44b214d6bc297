# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What survives a restart: a file with a snapshot of the content of an element, and the
calibration for its design and settings.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from mlmem import (
    Asked,
    Calibration,
    ErrorCode,
    Loop,
    MemoryElement,
    Outcome,
    Refused,
    SettingsError,
    StateError,
    atomic_files,
    snapshot,
    threads,
)
from mlmem.errors import OutcomeCode
from mlmem.parsing import DecodeError, decode_value, parse_json
from mlmem.procedure_table import PROCEDURES

from .settings import FileSettings, StateSettings
from .worker import ThrottledLog, Worker


class Store:
    """Keeps the state of an element in a file, or without a path nowhere.

    A worker thread writes to the disk, in the order in which states were taken. Neither the loop
    nor a caller waits for it.
    """

    def __init__(
        self,
        settings: StateSettings,
        files: FileSettings,
        log: ThrottledLog,
        worker: Worker,
        owner: str = 'another element',
    ) -> None:
        """Create it without opening a file.

        Successive stores share a worker, so that older writes come first. The name of the owner is
        shown to anyone else who wants the file.

        Raises:
            SettingsError: The path is invalid, or leads out of the root (see `files`).
        """
        # A lock belongs to a file, not to one of its names.
        self.path = (
            Path(os.path.realpath(files.confine_path(settings.path))) if settings.path else None
        )
        self._interval = settings.interval
        self._due = threads.monotonic() + self._interval
        self._log = log
        self._worker = worker
        self._owner = f'{owner} (process {os.getpid()})'
        self._claim: atomic_files.Claim | None = None

    def load_state(self) -> dict[str, Any] | None:
        """Claim the file and return the saved state, or None without one.

        Raises:
            StateError: Another element keeps its state in this file, or the file is damaged or
                cannot be read.
            Overdue: The disk does not answer.
        """
        if (path := self.path) is None:
            return None
        self._worker.do_and_wait(f'claiming {path}', lambda: self._take_claim(path))
        return self._worker.do_and_wait(f'reading {path}', lambda: load_snapshot(path))

    def restore_state(self, element: MemoryElement, saved: Mapping[str, Any] | None) -> None:
        """Give a device the state that `load_state` returned, if there is one.

        Raises:
            StateError: The file is damaged, or belongs to another design.
        """
        path = self.path
        if path is None:
            return
        if saved is None:
            blank = ': the element is blank' if element.is_simulated else ''
            self._log.info(f'no state in {path} yet{blank}')
            return
        try:
            snapshot.restore_snapshot(element, saved)
        except StateError as error:
            place = f'{path} does not belong to this design'
            raise StateError.of_error(error, place=place) from error
        what = 'state' if element.is_simulated else 'calibration and statistics'
        self._log.info(f'{what} restored from {path}')

    def save_state(self, element: MemoryElement) -> Future[None]:
        """Save the present state of an idle device; call it between ticks.

        Returns:
            None once it is safe on the disk; `StateError` or `Overdue` if it is not, which is also
            logged.
        """
        if (path := self.path) is None:
            saved = threads.Future[None]()
            saved.set_result(None)
            return saved
        taken = snapshot.take_snapshot(element)
        self._due = threads.monotonic() + self._interval
        saved = self._worker.do(f'saving the state in {path}', lambda: save_snapshot(path, taken))
        saved.add_done_callback(self._log_error)
        return saved

    def resolve(self, request: Asked, element: MemoryElement) -> None:
        """Answer a request whose procedure has ended, once its changes are safe on the disk.

        The answer is the outcome; a failure if the content could not be saved. Call it in the
        thread that runs the device.
        """
        outcome = request.outcome
        assert outcome is not None
        changed = PROCEDURES[outcome.procedure].changes
        if self.path is None or not changed or element.procedure:  # an abort will save it
            request.resolve(outcome)
            return
        try:
            saved = self.save_state(element)
        except Exception as error:
            self._log.exception('taking the state', error)
            request.resolve(_apply_save_result(outcome, error))
        else:
            saved.add_done_callback(
                lambda saved: request.resolve(_apply_save_result(outcome, saved.exception()))
            )

    def on_timer(self, loop: Loop | None) -> None:
        """Save at intervals, and answer overdue requests; call it once a second."""
        self._worker.on_timer()
        if self.path is None or self._interval == 0.0 or loop is None:
            return
        if threads.monotonic() >= self._due:
            loop.call(lambda: self._keep_if_idle(loop.element))

    def flush(self) -> bool:
        """Wait, but not for long, until all states are saved; return whether they are."""
        return self._worker.wait()

    def close(self) -> bool:
        """Release the file once all states are saved; return whether they are."""
        if (claim := self._claim) is not None:
            self._worker.do(f'releasing {self.path}', claim.release_file, anyway=True)
            self._claim = None
        return self.flush()

    def _take_claim(self, path: Path) -> None:
        try:
            atomic_files.make_directory(path.parent, exist_ok=True)
            claim = atomic_files.Claim(path, self._owner)
        except atomic_files.Claimed as error:
            why = f'{error}: give every element its own state.path'
            raise StateError(reason=why) from error
        except (OSError, ValueError) as error:
            why = f'the state cannot be kept in {path}: {atomic_files.describe_error(error)}'
            raise StateError(reason=why) from error
        try:
            self._worker.unless_given_up(lambda: setattr(self, '_claim', claim))
        except Refused:
            claim.release_file()
            raise

    def _keep_if_idle(self, element: MemoryElement) -> None:
        with self._log.guard_errors('taking the state'):
            if not element.procedure:  # else next time
                self.save_state(element)

    def _log_error(self, saved: Future[None]) -> None:
        if (error := saved.exception()) is not None:
            self._log.error(str(error))


def _apply_save_result(outcome: Outcome, error: BaseException | None) -> Outcome:
    """Return the outcome to report: a failure if the content is not on the disk."""
    if error is None:
        return outcome
    done = f'{outcome.procedure} succeeded' if outcome.success else outcome.error
    code = OutcomeCode.FAILED if outcome.success else outcome.code
    return dataclasses.replace(outcome, code=code, error=f'{done}, but is not saved: {error}')


def save_snapshot(path: Path, taken: Mapping[str, Any]) -> None:
    """Replace the file by what `snapshot.take_snapshot` returned, or leave it as it was; make its
    folder.

    Raises:
        StateError: The file cannot be written; the message says why.
    """
    content = json.dumps({'format': 1, 'snapshot': dict(taken)})
    try:
        atomic_files.make_directory(path.parent, exist_ok=True)
        atomic_files.write_atomically(path, content)
    except (OSError, ValueError) as error:
        why = f'the state cannot be saved in {path}: {atomic_files.describe_error(error)}'
        raise StateError(reason=why) from error


def load_snapshot(path: Path) -> dict[str, Any] | None:
    """Return the snapshot in a file, or None if there is no file yet.

    Raises:
        StateError: The file cannot be read, or holds no snapshot.
    """
    try:
        content = parse_json(atomic_files.read_text(path))
    except FileNotFoundError:
        return None
    except OSError as error:
        why = f'the state cannot be read from {path}: {atomic_files.describe_error(error)}'
        raise StateError(ErrorCode.UNREADABLE, reason=why) from error
    except ValueError as error:
        raise _build_damage_error(path, str(error)) from error
    found = content.get('snapshot') if isinstance(content, dict) else None
    if not isinstance(found, dict) or content.get('format') != 1:
        raise _build_damage_error(path, 'it must have format 1 and a snapshot')
    return found


def find_calibration(saved: Mapping[str, Any] | None, key: str, levels: int) -> Calibration | None:
    """Return the calibration in a snapshot, or None if it has none for a key; see
    `calibration_key`.
    """
    if saved is None or saved.get('calibration_key') != key:
        return None
    try:
        calibration: Calibration = decode_value(Calibration, saved.get('calibration'))
        calibration.check(levels)
    except (DecodeError, SettingsError):  # who restores the snapshot says what is wrong
        return None
    return calibration


def _build_damage_error(path: Path, why: str) -> StateError:
    """Return the error for a file that cannot be used."""
    why = f'{path} is damaged: {why}; move it away to start blank'
    return StateError(ErrorCode.MALFORMED, reason=why)
