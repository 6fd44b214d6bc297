# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files that survive a power cut: what is on the disk is the old content or the new, whole."""

from __future__ import annotations

import os
from pathlib import Path


def sync_directory(path: Path) -> None:
    """Make the entries of a directory (files created, renamed) durable.

    Args:
        path: The directory.

    Raises:
        OSError: The directory is gone or the disk refuses.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_atomically(path: Path, text: str) -> None:
    """Replace a file by new content, or leave it exactly as it was.

    Args:
        path: The file, which may not exist yet.
        text: Its new content, written as UTF-8.

    Raises:
        OSError: The directory is gone, the disk is full or writing is not permitted.
    """
    # The temporary file lies beside its target because a rename is atomic only within one
    # file system. It is hidden so that no tool takes it for a part of the bag.
    temporary = path.with_name(f'.{path.name}.new')
    try:
        with temporary.open('w', encoding='utf-8', newline='') as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    sync_directory(path.parent)
