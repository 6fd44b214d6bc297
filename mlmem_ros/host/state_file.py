# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The content of a non-volatile memory between two runs: a snapshot in a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import durable
from ..described import printable
from ..outside import LONGEST, from_json
from ..physics import StateError

FORMAT = 1
"""Version of the file."""


def save(path: Path, snapshot: Mapping[str, Any]) -> None:
    """Replace the file by what `snapshot.take` returned, or leave it as it was; make its folder.

    Raises:
        StateError: The file cannot be written; the message says why.
    """
    write(path, 'snapshot', snapshot, 'the state')


def load(path: Path) -> dict[str, Any] | None:
    """Return the snapshot in a file, or None if there is no file yet.

    Raises:
        StateError: The file cannot be read, or holds no snapshot.
    """
    return read(path, 'snapshot', 'the state', 'start blank')


def write(path: Path, key: str, values: Mapping[str, Any], what: str) -> None:
    """Replace a file by values under a key; `what` they are is for the message of an error."""
    try:
        durable.make_directory(path.parent, exist_ok=True)
        durable.write_atomically(path, json.dumps({'format': FORMAT, key: dict(values)}))
    except (OSError, ValueError) as error:
        why = durable.reason(error)
        raise StateError(f'{what} cannot be saved in {path}: {why}') from error


def read(path: Path, key: str, what: str, remedy: str) -> dict[str, Any] | None:
    """Return what `write` stored; `remedy` says what moving a damaged file away achieves."""
    try:
        content = from_json(durable.read_text(path))
    except FileNotFoundError:
        return None
    except OSError as error:
        why = f'{what} cannot be read from {path}: {durable.reason(error)}'
        raise StateError(printable(why, LONGEST)) from error
    except ValueError as error:
        raise damaged(path, str(error), remedy) from error
    found = content.get(key) if isinstance(content, dict) else None
    if not isinstance(found, dict) or content.get('format') != FORMAT:
        raise damaged(path, f'it must have format {FORMAT} and a {key}', remedy)
    return found


def damaged(path: Path, why: str, remedy: str) -> StateError:
    """Return the error for a file that cannot be used."""
    return StateError(printable(f'{path} is damaged: {why}; move it away to {remedy}', LONGEST))
