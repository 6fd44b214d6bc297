# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrations that outlive a run: one for every design and settings that an element had."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import durable
from ..physics import StateError
from .calibration import Calibration
from .errors import SettingsError

FORMAT = 1
"""Version of the file."""

KEPT = 32
"""Most calibrations in a file; the oldest makes room for a new one."""


def beside(state: Path) -> Path:
    """Return the calibration file that belongs to a state file."""
    return state.with_name(f'{state.stem}.calibration.json')


def load(path: Path, key: str, levels: int) -> Calibration | None:
    """Return the calibration saved under a key, or None if there is none yet.

    Args:
        path: The file.
        key: The result of `calibration.calibration_key`.
        levels: Number of levels it must have.

    Raises:
        StateError: The file cannot be read, or is damaged.
    """
    values = _load(path).get(key)
    if values is None:
        return None
    try:
        calibration = Calibration.from_dict(values)
        calibration.check(levels)
    except SettingsError as error:
        raise _damaged(path, str(error)) from error
    return calibration


def save(path: Path, key: str, calibration: Calibration) -> None:
    """Store a calibration under a key, beside those under other keys.

    Raises:
        StateError: The file cannot be read or written; it is left as it was.
    """
    kept = _load(path)
    kept.pop(key, None)
    kept[key] = calibration.as_dict()
    newest = dict(list(kept.items())[-KEPT:])
    try:
        durable.make_directory(path.parent, exist_ok=True)
        text = json.dumps({'format': FORMAT, 'calibrations': newest})
        durable.write_atomically(path, text)
    except (OSError, ValueError) as error:
        why = durable.reason(error)
        raise StateError(f'the calibration cannot be saved in {path}: {why}') from error


def _load(path: Path) -> dict[str, Any]:
    """Return a file's calibrations by key; empty if there is no file yet."""
    try:
        content = json.loads(durable.read_text(path))
    except FileNotFoundError:
        return {}
    except OSError as error:
        why = durable.reason(error)
        raise StateError(f'calibrations cannot be read from {path}: {why}') from error
    except (ValueError, RecursionError) as error:
        raise _damaged(path, str(error)) from error
    kept = content.get('calibrations') if isinstance(content, Mapping) else None
    if not isinstance(kept, dict) or content.get('format') != FORMAT:
        raise _damaged(path, f'it must have format {FORMAT} and calibrations')
    return kept


def _damaged(path: Path, why: str) -> StateError:
    return StateError(
        f'{path} must be a file of calibrations; it is damaged: {why}; move it away to '
        'calibrate anew'
    )
