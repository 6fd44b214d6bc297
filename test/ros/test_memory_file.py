# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Saving the content: a late thread never puts an older state over a newer one."""

import pytest

from mlmem_ros.device import new_element, snapshot, state_file
from mlmem_ros.physics import CASE_II
from mlmem_ros.ros.gate import Gate
from mlmem_ros.ros.memory_file import MemoryFile
from mlmem_ros.ros.settings import StateSettings


@pytest.fixture
def file(tmp_path):
    return tmp_path / 'element.json'


def test_an_older_snapshot_is_not_written_over_a_newer_one(file):
    element = new_element(CASE_II)
    memory_file = MemoryFile(None, StateSettings(path=str(file), interval=0.0), Gate())
    older = snapshot.take(element)  # taken at an interval, its thread is slow
    element.advance()
    memory_file.save(element)  # the node is deactivated meanwhile
    memory_file._write(older)
    assert state_file.load(file)['ticks'] == element.ticks
    element.advance()
    memory_file.save(element)
    assert state_file.load(file)['ticks'] == element.ticks
