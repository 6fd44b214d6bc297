# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A file is replaced whole or not at all."""

import os

import pytest

from mlmem_ros.durable import write_atomically


def test_the_old_content_is_replaced(tmp_path):
    file = tmp_path / 'file'
    write_atomically(file, 'old, and longer')
    write_atomically(file, 'new')
    assert file.read_text() == 'new'


def test_a_failed_write_leaves_the_old_content(tmp_path, monkeypatch):
    file = tmp_path / 'file'
    write_atomically(file, 'old')

    def refuse(descriptor):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'fsync', refuse)
    with pytest.raises(OSError, match='No space left'):
        write_atomically(file, 'new')
    assert file.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [file]
