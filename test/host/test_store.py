# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Content and calibration: nothing old replaces newer, nothing is calibrated twice."""

import dataclasses

import pytest

from mlmem import MemoryElement, factory
from mlmem.physics import CASE_II, StateError
from mlmem.settings import ProbeSettings
from mlmem_ros.host import ThrottledLog
from mlmem_ros.host.building import build_device
from mlmem_ros.host.settings import FileSettings, StateSettings
from mlmem_ros.host.store import Store, load_snapshot
from mlmem_ros.host.worker import Worker


@pytest.fixture
def file(tmp_path):
    return tmp_path / 'element.json'


@pytest.fixture
def kept():
    """Make a store: kept(file); the one before is closed, since a file has one owner."""
    stores = []

    def kept(file):
        for store in stores:
            assert store.close()
        stores.append(_store(file))
        return stores[-1]

    yield kept
    for store in stores:
        store.close()


def _store(file):
    settings = StateSettings(path=str(file), interval=0.0)
    throttled = ThrottledLog(lambda *_: None)
    return Store(settings, FileSettings(), throttled, Worker('test-store', throttled))


def test_link_leads_to_the_file_that_is_kept(file, kept, tmp_path):
    link, element = tmp_path / 'link.json', MemoryElement(CASE_II)
    link.symlink_to(file)
    element.advance()
    kept(link).save_state(element).result(20.0)
    assert link.is_symlink()
    assert load_snapshot(file)['ticks'] == 1
    loop = tmp_path / 'loop.json'
    loop.symlink_to(loop)
    with pytest.raises(StateError, match=r'loop\.json'):
        kept(loop).load_state()


# --- calibrations -----------------------------------------------------------------------------


def test_state_below_a_file_is_rejected(file, kept):
    file.touch()
    with pytest.raises(StateError, match='cannot be kept'):
        kept(file / 'element.json').load_state()


@pytest.fixture
def counted(monkeypatch):
    """Count the calibrations on an ideal element."""
    made = []

    def count(design, settings):
        made.append(settings)
        return calibrate(design, settings)

    calibrate = factory.factory_calibration
    monkeypatch.setattr(factory, 'factory_calibration', count)
    return made


def test_design_is_calibrated_once(file, counted, parameters):
    def build(settings):
        throttled = ThrottledLog(lambda *_: None)
        given = dataclasses.replace(
            parameters, settings=settings, state=StateSettings(path=str(file), interval=0.0)
        )
        device = build_device(given, throttled, Worker('test', throttled), '/mlmem', blank=False)
        device.store.save_state(device.element).result(20.0)
        assert device.store.close()
        return device.element.calibration

    first = build(parameters.settings)
    assert build(parameters.settings) == first
    assert len(counted) == 1
    probe = ProbeSettings(omega_c=0.7, v_th=7e-4)
    assert build(dataclasses.replace(parameters.settings, probe_right=probe)) != first
    assert len(counted) == 2
