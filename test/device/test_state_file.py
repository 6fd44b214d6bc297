# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What cannot be saved or read is refused with the reason."""

from pathlib import Path

import pytest

from mlmem_ros.device import state_file
from mlmem_ros.physics import StateError


@pytest.mark.parametrize('path', ['/tmp/\0', '/proc/nowhere/state.json', f'/tmp/{"x" * 300}'])
def test_a_path_that_cannot_be_written_is_refused(path):
    with pytest.raises(StateError, match='cannot be saved in'):
        state_file.save(Path(path), {})


def test_where_no_file_is_there_is_no_state(tmp_path):
    assert state_file.load(tmp_path / 'state.json') is None


@pytest.mark.parametrize('text', ['', '\xff', '[' * 100_000, '7', '{"format": 1}'])
def test_a_damaged_file_is_refused(tmp_path, text):
    file = tmp_path / 'state.json'
    file.write_bytes(text.encode('latin-1'))
    with pytest.raises(StateError, match=r'must (be a state file|hold a snapshot)'):
        state_file.load(file)
