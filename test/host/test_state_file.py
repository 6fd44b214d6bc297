# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state file holds one exact snapshot; errors say what is wrong with a file."""

import json
import tracemalloc
from pathlib import Path

import pytest

from mlmem_ros.device import snapshot
from mlmem_ros.host import state_file
from mlmem_ros.physics import StateError

from ..device import rig


def test_a_device_goes_on_to_the_bit_where_its_file_was_saved(tmp_path):
    path = tmp_path / 'new' / 'folder' / 'element.json'
    element = rig.device(3)
    rig.ticks(element, 7)
    state_file.save(path, snapshot.take(element))
    other = rig.device()
    snapshot.restore(other, state_file.load(path))
    assert snapshot.digest(other) == snapshot.digest(element)
    assert other.ticks == 7


def test_a_second_save_replaces_the_first(tmp_path):
    state_file.save(tmp_path / 'element.json', {'ticks': 1})
    state_file.save(tmp_path / 'element.json', {'ticks': 2})
    assert state_file.load(tmp_path / 'element.json') == {'ticks': 2}
    assert [path.name for path in tmp_path.iterdir()] == ['element.json']


def test_without_a_file_nothing_is_restored(tmp_path):
    assert state_file.load(tmp_path / 'element.json') is None


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        ('', 'is damaged: it must be JSON; Expecting value'),
        ('\xff', "is damaged: 'utf-8' codec can't decode"),
        ('[' * 100_000, 'is damaged: it must be JSON; it is nested too deeply'),
        ('{"format": 1, "snap', 'is damaged: it must be JSON; Unterminated string'),
        ('[]', 'is damaged: it must have format 1 and a snapshot; move it away to start blank'),
        ('{"format": 2, "snapshot": {}}', 'is damaged: it must have format 1'),
        ('{"format": 1}', 'is damaged: it must have format 1 and a snapshot'),
        ('{"format": 1, "snapshot": []}', 'is damaged: it must have format 1 and a snapshot'),
    ],
)
def test_a_damaged_file_is_refused_and_kept(tmp_path, text, told):
    path = tmp_path / 'element.json'
    path.write_bytes(text.encode('latin-1'))
    with pytest.raises(StateError, match=rf'element\.json {told}'):
        state_file.load(path)
    assert path.read_bytes() == text.encode('latin-1')


def test_a_huge_file_is_refused_before_it_fills_the_memory(tmp_path):
    """50 GB of zeros, which take no room on the disk."""
    path = tmp_path / 'element.json'
    with path.open('wb') as file:
        file.truncate(50 * 10**9)
    tracemalloc.start()
    try:
        with pytest.raises(StateError, match='is damaged: it is larger than 33554432 bytes'):
            state_file.load(path)
        assert tracemalloc.get_traced_memory()[1] < 80e6  # twice what is read
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize('path', ['/tmp/\0', '/proc/nowhere/state.json', f'/tmp/{"x" * 300}'])
def test_a_path_that_cannot_be_written_is_refused(path):
    with pytest.raises(StateError, match='cannot be saved in'):
        state_file.save(Path(path), {})


def test_a_file_that_cannot_be_read_or_written_is_reported_with_the_reason(tmp_path):
    """A folder in place of the file, and a file in place of its folder."""
    with pytest.raises(StateError, match=r'cannot be read from .*: Is a directory'):
        state_file.load(tmp_path)
    (tmp_path / 'file').write_text('')
    with pytest.raises(StateError, match=r'cannot be saved in .*: (File exists|Not a directory)'):
        state_file.save(tmp_path / 'file' / 'element.json', {})


def test_the_file_is_plain_json(tmp_path):
    state_file.save(tmp_path / 'element.json', {'ticks': 5})
    content = json.loads((tmp_path / 'element.json').read_text())
    assert content == {'format': 1, 'snapshot': {'ticks': 5}}
