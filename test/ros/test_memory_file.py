# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Keeping content and calibration: nothing older over newer, nothing calibrated twice."""

import dataclasses
import logging
from types import SimpleNamespace

import pytest

from mlmem_ros.device import DelayTable, Settings, factory, new_element, snapshot, state_file
from mlmem_ros.device.settings import ProbeSettings
from mlmem_ros.physics import CASE_II
from mlmem_ros.ros.gate import Gate
from mlmem_ros.ros.memory_file import MemoryFile
from mlmem_ros.ros.settings import StateSettings


@pytest.fixture
def file(tmp_path):
    return tmp_path / 'element.json'


def test_an_older_snapshot_is_not_written_over_a_newer_one(file):
    element = new_element(CASE_II)
    memory_file = MemoryFile(None, StateSettings(path=str(file), interval=0.0), '', Gate())
    older = snapshot.take(element)  # taken at an interval, its thread is slow
    element.advance()
    memory_file.save(element)  # the node is deactivated meanwhile
    memory_file._write(older)
    assert state_file.load(file)['ticks'] == element.ticks
    element.advance()
    memory_file.save(element)
    assert state_file.load(file)['ticks'] == element.ticks


# --- calibrations -----------------------------------------------------------------------------


@pytest.fixture
def counted(monkeypatch):
    """Count the calibrations on an ideal element, which take their time."""
    made = []

    def count(design, settings):
        made.append(settings)
        return calibrate(design, settings)

    calibrate = factory.factory_calibration
    monkeypatch.setattr(factory, 'factory_calibration', count)
    return made


def kept(file):
    return MemoryFile(None, StateSettings(path=str(file), interval=0.0), '', Gate())


def test_a_design_is_calibrated_once(file, counted):
    first = kept(file).new_element(CASE_II, Settings())
    assert kept(file).new_element(CASE_II, Settings()).calibration == first.calibration
    assert len(counted) == 1
    other = Settings(probe_right=ProbeSettings(omega_c=0.7, v_th=7e-4))
    assert kept(file).new_element(CASE_II, other).calibration != first.calibration
    assert len(counted) == 2
    for settings in (Settings(), other):
        kept(file).new_element(CASE_II, settings)
    assert len(counted) == 2


def test_without_a_state_file_nothing_is_kept(tmp_path, counted):
    for _ in range(2):
        MemoryFile(None, StateSettings(), '', Gate()).new_element(CASE_II, Settings())
    assert len(counted) == 2
    assert list(tmp_path.iterdir()) == []


def test_what_was_learnt_is_known_even_where_the_state_is_gone(file):
    memory_file = kept(file)
    element = memory_file.new_element(CASE_II, Settings())
    left = element.calibration.left
    learnt = dataclasses.replace(
        element.calibration,
        left=dataclasses.replace(left, delays=tuple(delay + 1 / 3 for delay in left.delays)),
    )
    element.calibration = learnt
    memory_file.save(element)
    file.unlink()
    assert kept(file).new_element(CASE_II, Settings()).calibration == learnt


def test_a_state_of_0_1_0_brings_its_content_and_not_its_delays(file):
    """Its right pulse was another; what it learnt does not belong to the present one."""
    element = new_element(CASE_II)
    element.calibration = dataclasses.replace(
        element.calibration,
        right=DelayTable(tuple(1000.0 - level for level in range(8)), blank=2000.0),
    )
    saved = snapshot.take(element)
    del saved['calibration_key'], saved['statistics']
    state_file.save(file, saved)
    memory_file = MemoryFile(rclpy_node(), StateSettings(path=str(file), interval=0.0), '', Gate())
    restored = memory_file.new_element(CASE_II, Settings())
    memory_file.restore(restored)
    assert snapshot.digest(restored) == snapshot.digest(element)
    assert restored.calibration == new_element(CASE_II).calibration


def rclpy_node():
    """Return what of a node a memory file needs to say something."""
    return SimpleNamespace(get_logger=lambda: logging.getLogger('test'))
