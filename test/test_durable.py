# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A file is replaced whole or not at all; a failure leaves nothing behind."""

import os
from unittest.mock import patch

import pytest

from mlmem import atomic_files
from mlmem.atomic_files import make_directory, write_atomically


def refuse(name):
    """Let a function of os fail for a while."""
    return patch.object(os, name, side_effect=OSError(28, 'No space left on device'))


def open_files():
    return os.listdir('/proc/self/fd')


@pytest.mark.parametrize('step', ['write', 'fsync', 'replace'])
def test_failed_write_leaves_the_old_content(tmp_path, step):
    file = tmp_path / 'file'
    write_atomically(file, 'old')
    before = open_files()
    with refuse(step), pytest.raises(OSError, match='No space left'):
        write_atomically(file, 'new')
    assert file.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [file]
    assert open_files() == before


def test_file_that_cannot_be_made_durable_is_closed(tmp_path):
    before = open_files()
    with refuse('fsync'), pytest.raises(OSError, match='No space left'):
        atomic_files.create_file(tmp_path / 'file')
    assert open_files() == before


def test_file_closed_twice_closes_no_other(tmp_path):
    first = atomic_files.create_file(tmp_path / 'first')
    first.close()
    second = atomic_files.create_file(tmp_path / 'second')
    first.close()
    second.write(b'still open')
    second.close()


def test_new_directories_are_synced_into_their_parents(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr(atomic_files, 'sync_directory', synced.append)
    made = tmp_path / 'a' / 'b' / 'c'
    make_directory(made)
    assert {tmp_path, made.parent, made.parents[1]} <= set(synced)
    make_directory(made, exist_ok=True)
    (made / 'file').touch()
    for there, is_allowed in ((made, False), (made / 'file', True)):
        with pytest.raises(FileExistsError):
            make_directory(there, exist_ok=is_allowed)
