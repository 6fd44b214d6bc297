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
from mlmem.parsing import MAX_MESSAGE_CHARS, DecodeError, decode_value, encode_value, parse_json
from mlmem.physics import StateError
from mlmem.schema import make_printable

FILE_FORMAT = 1
"""Version of the file."""


def save_snapshot(path: Path, snapshot: Mapping[str, Any]) -> None:
    """Replace the file by what `snapshot.take_snapshot` returned, or leave it as it was; make its
    folder.

    Raises:
        StateError: The file cannot be written; the message says why.
    """
    _write_file(path, 'snapshot', snapshot, 'the state')


def load_snapshot(path: Path) -> dict[str, Any] | None:
    """Return the snapshot in a file, or None if there is no file yet.

    Raises:
        StateError: The file cannot be read, or holds no snapshot.
    """
    return _read_file(path, 'snapshot', 'the state', 'start blank')


def _write_file(path: Path, key: str, values: Mapping[str, Any], what: str) -> None:
    """Replace a file by values under a key; `what` they are is for the message of an error."""
    try:
        atomic_files.make_directory(path.parent, exist_ok=True)
        atomic_files.write_atomically(path, json.dumps({'format': FILE_FORMAT, key: dict(values)}))
    except (OSError, ValueError) as error:
        why = atomic_files.describe_error(error)
        raise StateError(f'{what} cannot be saved in {path}: {why}') from error


def _read_file(path: Path, key: str, what: str, remedy: str) -> dict[str, Any] | None:
    """Return what `_write_file` stored; `remedy` says what moving a damaged file away achieves."""
    try:
        content = parse_json(atomic_files.read_text(path))
    except FileNotFoundError:
        return None
    except OSError as error:
        why = f'{what} cannot be read from {path}: {atomic_files.describe_error(error)}'
        raise StateError(make_printable(why, MAX_MESSAGE_CHARS)) from error
    except ValueError as error:
        raise _build_damage_error(path, str(error), remedy) from error
    found = content.get(key) if isinstance(content, dict) else None
    if not isinstance(found, dict) or content.get('format') != FILE_FORMAT:
        raise _build_damage_error(path, f'it must have format {FILE_FORMAT} and a {key}', remedy)
    return found


def _build_damage_error(path: Path, why: str, remedy: str) -> StateError:
    """Return the error for a file that cannot be used."""
    return StateError(
        make_printable(f'{path} is damaged: {why}; move it away to {remedy}', MAX_MESSAGE_CHARS)
    )


MAX_CALIBRATIONS = 32
"""Most calibrations in a file; a new one replaces the oldest."""

_CALIBRATION_TEXTS = 'calibrations', 'the calibrations', 'calibrate again'


def calibration_path(state: Path) -> Path:
    """Return the calibration file that belongs to a state file."""
    return state.with_name(f'{state.stem}.calibration.json')


def load_calibration(path: Path, key: str, levels: int) -> Calibration | None:
    """Return the calibration saved under a key (see `calibration_key`), or None if there is none
    yet.

    Raises:
        StateError: The file cannot be read, or is damaged.
    """
    values = (_read_file(path, *_CALIBRATION_TEXTS) or {}).get(key)
    if values is None:
        return None
    try:
        calibration: Calibration = decode_value(Calibration, values)
        calibration.check(levels)
    except (DecodeError, SettingsError) as error:
        raise _build_damage_error(path, str(error), _CALIBRATION_TEXTS[-1]) from error
    return calibration


def save_calibration(path: Path, key: str, calibration: Calibration) -> None:
    """Store a calibration under a key, beside those under other keys.

    Raises:
        StateError: The file cannot be read or written; it is left as it was.
    """
    kept = _read_file(path, *_CALIBRATION_TEXTS) or {}
    kept.pop(key, None)
    kept[key] = encode_value(calibration)
    _write_file(
        path, 'calibrations', dict(list(kept.items())[-MAX_CALIBRATIONS:]), 'the calibration'
    )
