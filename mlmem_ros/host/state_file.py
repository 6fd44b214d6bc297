# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a non-volatile memory keeps between two runs, in files: its content, a snapshot; and
calibrations, one for each design and settings that the element has had.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mlmem import Calibration, SettingsError, atomic_files
from mlmem.parsing import LONGEST, DecodeError, decode, from_json
from mlmem.physics import StateError
from mlmem.schema import printable

FORMAT = 1
"""Version of the file."""


def save(path: Path, snapshot: Mapping[str, Any]) -> None:
    """Replace the file by what `snapshot.take` returned, or leave it as it was; make its folder.

    Raises:
        StateError: The file cannot be written; the message says why.
    """
    _write(path, 'snapshot', snapshot, 'the state')


def load(path: Path) -> dict[str, Any] | None:
    """Return the snapshot in a file, or None if there is no file yet.

    Raises:
        StateError: The file cannot be read, or holds no snapshot.
    """
    return _read(path, 'snapshot', 'the state', 'start blank')


def _write(path: Path, key: str, values: Mapping[str, Any], what: str) -> None:
    """Replace a file by values under a key; `what` they are is for the message of an error."""
    try:
        atomic_files.make_directory(path.parent, exist_ok=True)
        atomic_files.write_atomically(path, json.dumps({'format': FORMAT, key: dict(values)}))
    except (OSError, ValueError) as error:
        why = atomic_files.reason(error)
        raise StateError(f'{what} cannot be saved in {path}: {why}') from error


def _read(path: Path, key: str, what: str, remedy: str) -> dict[str, Any] | None:
    """Return what `_write` stored; `remedy` says what moving a damaged file away achieves."""
    try:
        content = from_json(atomic_files.read_text(path))
    except FileNotFoundError:
        return None
    except OSError as error:
        why = f'{what} cannot be read from {path}: {atomic_files.reason(error)}'
        raise StateError(printable(why, LONGEST)) from error
    except ValueError as error:
        raise _damaged(path, str(error), remedy) from error
    found = content.get(key) if isinstance(content, dict) else None
    if not isinstance(found, dict) or content.get('format') != FORMAT:
        raise _damaged(path, f'it must have format {FORMAT} and a {key}', remedy)
    return found


def _damaged(path: Path, why: str, remedy: str) -> StateError:
    """Return the error for a file that cannot be used."""
    return StateError(printable(f'{path} is damaged: {why}; move it away to {remedy}', LONGEST))


KEPT = 32
"""Most calibrations in a file; a new one replaces the oldest."""

_WHAT = 'calibrations', 'the calibrations', 'calibrate again'


def calibrations_beside(state: Path) -> Path:
    """Return the calibration file that belongs to a state file."""
    return state.with_name(f'{state.stem}.calibration.json')


def load_calibration(path: Path, key: str, levels: int) -> Calibration | None:
    """Return the calibration saved under a key (see `calibration_key`), or None if there is none
    yet.

    Raises:
        StateError: The file cannot be read, or is damaged.
    """
    values = (_read(path, *_WHAT) or {}).get(key)
    if values is None:
        return None
    try:
        calibration: Calibration = decode(Calibration, values)
        calibration.check(levels)
    except (DecodeError, SettingsError) as error:
        raise _damaged(path, str(error), _WHAT[-1]) from error
    return calibration


def save_calibration(path: Path, key: str, calibration: Calibration) -> None:
    """Store a calibration under a key, beside those under other keys.

    Raises:
        StateError: The file cannot be read or written; it is left as it was.
    """
    kept = _read(path, *_WHAT) or {}
    kept.pop(key, None)
    kept[key] = calibration.as_dict()
    _write(path, 'calibrations', dict(list(kept.items())[-KEPT:]), 'the calibration')
