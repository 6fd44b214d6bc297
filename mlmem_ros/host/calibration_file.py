# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A file of calibrations: one for each design and settings that an element has had."""

from __future__ import annotations

from pathlib import Path

from ..device import Calibration, SettingsError
from ..outside import DecodeError, decode
from . import state_file

KEPT = 32
"""Most calibrations in a file; a new one replaces the oldest."""

_WHAT = 'calibrations', 'the calibrations', 'calibrate again'


def beside(state: Path) -> Path:
    """Return the calibration file that belongs to a state file."""
    return state.with_name(f'{state.stem}.calibration.json')


def load(path: Path, key: str, levels: int) -> Calibration | None:
    """Return the calibration saved under a key (see `calibration_key`), or None if there is none
    yet.

    Raises:
        StateError: The file cannot be read, or is damaged.
    """
    values = (state_file.read(path, *_WHAT) or {}).get(key)
    if values is None:
        return None
    try:
        calibration: Calibration = decode(Calibration, values)
        calibration.check(levels)
    except (DecodeError, SettingsError) as error:
        raise state_file.damaged(path, str(error), _WHAT[-1]) from error
    return calibration


def save(path: Path, key: str, calibration: Calibration) -> None:
    """Store a calibration under a key, beside those under other keys.

    Raises:
        StateError: The file cannot be read or written; it is left as it was.
    """
    kept = state_file.read(path, *_WHAT) or {}
    kept.pop(key, None)
    kept[key] = calibration.as_dict()
    state_file.write(path, 'calibrations', dict(list(kept.items())[-KEPT:]), 'the calibration')
