# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a non-volatile memory keeps between two runs, in a file: a snapshot of its content, and the
calibration for its design and settings.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mlmem import Calibration, SettingsError, atomic_files
from mlmem.parsing import MAX_MESSAGE_CHARS, DecodeError, decode_value, parse_json
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
    content = json.dumps({'format': FILE_FORMAT, 'snapshot': dict(snapshot)})
    try:
        atomic_files.make_directory(path.parent, exist_ok=True)
        atomic_files.write_atomically(path, content)
    except (OSError, ValueError) as error:
        why = atomic_files.describe_error(error)
        raise StateError(f'the state cannot be saved in {path}: {why}') from error


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
        raise StateError(make_printable(why, MAX_MESSAGE_CHARS)) from error
    except ValueError as error:
        raise _build_damage_error(path, str(error)) from error
    found = content.get('snapshot') if isinstance(content, dict) else None
    if not isinstance(found, dict) or content.get('format') != FILE_FORMAT:
        raise _build_damage_error(path, f'it must have format {FILE_FORMAT} and a snapshot')
    return found


def find_calibration(
    snapshot: Mapping[str, Any] | None, key: str, levels: int
) -> Calibration | None:
    """Return the calibration in a snapshot, or None if it has none for a key; see
    `calibration_key`.
    """
    if snapshot is None or snapshot.get('calibration_key') != key:
        return None
    try:
        calibration: Calibration = decode_value(Calibration, snapshot.get('calibration'))
        calibration.check(levels)
    except (DecodeError, SettingsError):  # who restores the snapshot says what is wrong
        return None
    return calibration


def _build_damage_error(path: Path, why: str) -> StateError:
    """Return the error for a file that cannot be used."""
    text = f'{path} is damaged: {why}; move it away to start blank'
    return StateError(make_printable(text, MAX_MESSAGE_CHARS))
