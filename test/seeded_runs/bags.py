# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What real readers must find in a recording on a simulated disk: every message, exactly."""

import os
import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from mlmem import atomic_files
from mlmem_ros.bag.contents import read_metadata
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay

DISK_FOLDER = '/disk'


@cache
def _make_folder():
    """Return a folder in memory, where there is one; it goes with the process."""
    memory = Path('/dev/shm')
    return TemporaryDirectory(prefix='runs-', dir=memory if memory.is_dir() else None)


def find_bag_errors(disk, closed):
    """Yield what is wrong with the bags on a disk.

    Args:
        disk: The disk, after the recording process has ended.
        closed: Paths of the bags that were reported as closed.
    """
    names = [name for name in disk.list_names(DISK_FOLDER) if name.startswith('session')]
    for path in closed:
        if path.name not in names:
            yield f'{path} was closed and is not there'
    if not names:
        return
    folder = Path(_make_folder().name) / DISK_FOLDER.strip('/')
    shutil.rmtree(folder, ignore_errors=True)
    disk.write_to_folder(folder.parent)
    for name in names:
        try:
            with patch.object(atomic_files, 'os', os):  # the copy is on a real disk
                found = list(_find_errors(folder / name, whole=Path(DISK_FOLDER) / name in closed))
        except BagError as error:
            found = [f'{name}: {error}']
        yield from found


def count_promised(metadata):
    """Return how many messages were synced when the metadata was written."""
    return sum(metadata.message_counts.values()) if metadata else 0


def _find_errors(bag, whole):
    try:
        reader = BagReader(bag)
    except BagError as error:
        promised = count_promised(read_metadata(bag))
        if promised or whole:
            yield f'{bag.name} has {promised} messages that were synced, and: {error}'
        return
    promised = count_promised(reader.metadata)
    count = sum(1 for _ in reader)
    if count < promised:
        yield f'{bag.name} has {count} messages; {promised} were synced'
    if whole and reader.losses:
        yield f'{bag.name} was closed and is not whole: {reader.losses}'
    topics = reader.topics
    if not any(name.endswith('/session') and info.message_count for name, info in topics.items()):
        return  # no session has begun, or its beginning was not synced
    report = run_replay(load_session(reader))
    if not report.exact or report.refused:
        differs = report.states.first_difference
        yield f'{bag.name} does not replay: {differs}, refused: {report.refused}'
