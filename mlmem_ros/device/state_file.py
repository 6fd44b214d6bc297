# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The content of a non-volatile memory between two runs: a snapshot in a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import durable
from ..physics import StateError

FORMAT = 1
"""Version of the file."""


def save(path: Path, snapshot: Mapping[str, Any]) -> None:
    """Replace the file by a snapshot, or leave it as it was.

    Args:
        path: The file; missing folders are made.
        snapshot: What `snapshot.take` returned.

    Raises:
        StateError: The file cannot be written; the message says why.
    """
    try:
        durable.make_directory(path.parent, exist_ok=True)
        text = json.dumps({'format': FORMAT, 'snapshot': dict(snapshot)})
        durable.write_atomically(path, text)
    except (OSError, ValueError) as error:
        why = durable.reason(error)
        raise StateError(f'the state cannot be saved in {path}: {why}') from error


def load(path: Path) -> dict[str, Any] | None:
    """Return the snapshot in a file, or None where there is no file yet.

    Raises:
        StateError: The file cannot be read, or holds no snapshot.
    """
    try:
        content = json.loads(durable.read_text(path))
    except FileNotFoundError:
        return None
    except OSError as error:
        why = durable.reason(error)
        raise StateError(f'the state cannot be read from {path}: {why}') from error
    except (ValueError, RecursionError) as error:
        raise StateError(f'{path} must be a state file; it is damaged: {error}') from error
    if not isinstance(content, dict) or content.get('format') != FORMAT:
        raise StateError(
            f'{path} must be a state file of format {FORMAT}; move it away to start blank'
        )
    snapshot = content.get('snapshot')
    if not isinstance(snapshot, dict):
        raise StateError(f'{path} must hold a snapshot; move it away to start blank')
    return snapshot
