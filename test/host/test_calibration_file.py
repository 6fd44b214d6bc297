# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrations in a file: by design and settings, exact, and never a damaged one."""

import dataclasses
import json

import pytest

from mlmem_ros.device import Calibration, DelayTable, Settings
from mlmem_ros.device.calibration import calibration_key
from mlmem_ros.device.move_settings import WriteSettings
from mlmem_ros.device.settings import ReadSettings, TimeSettings
from mlmem_ros.host import calibration_file
from mlmem_ros.physics import CASE_I, CASE_II, StateError

from ..device import rig

THIRDS = Calibration(DelayTable((1 / 3, 2 / 3)), DelayTable((2.0, 1.0), blank=0.1 + 0.2))
OTHER = Calibration(DelayTable((1.0, 2.0)), DelayTable((2.0, 1.0)))


@pytest.fixture
def path(tmp_path):
    return calibration_file.beside(tmp_path / 'folder' / 'element.json')


def test_it_lies_beside_the_state(tmp_path):
    found = calibration_file.beside(tmp_path / 'element.json')
    assert found == tmp_path / 'element.calibration.json'


def test_what_was_saved_is_loaded_to_the_bit_and_by_its_key(path):
    assert calibration_file.load(path, 'a', 2) is None
    calibration_file.save(path, 'a', THIRDS)
    calibration_file.save(path, 'b', OTHER)
    assert calibration_file.load(path, 'a', 2) == THIRDS
    assert calibration_file.load(path, 'b', 2) == OTHER
    assert calibration_file.load(path, 'c', 2) is None
    calibration_file.save(path, 'a', OTHER)
    assert calibration_file.load(path, 'a', 2) == OTHER


def test_the_oldest_calibrations_are_dropped(path):
    for number in range(calibration_file.KEPT + 2):
        calibration_file.save(path, str(number), OTHER)
        calibration_file.save(path, 'a', THIRDS)  # kept young
    kept = json.loads(path.read_text())['calibrations']
    assert len(kept) == calibration_file.KEPT
    assert '2' not in kept
    assert '3' in kept
    assert calibration_file.load(path, 'a', 2) == THIRDS


@pytest.mark.parametrize(
    'text',
    ['', '{', '[]', '{"format": 2, "calibrations": {}}', '{"format": 1, "calibrations": []}',
     '{"format": 1, "calibrations": {"a": 7}}', '{"format": 1, "calibrations": {"a": {}}}',
     '{"format": 1, "calibrations": {"a": {"left": 1, "right": 2}}}'],
)  # fmt: skip
def test_a_damaged_file_is_refused_and_kept(path, text):
    path.parent.mkdir()
    path.write_text(text)
    with pytest.raises(StateError, match=r'\.json is damaged: .*; move it away to calibrate'):
        calibration_file.load(path, 'a', 2)
    assert path.read_text() == text


def test_a_calibration_of_other_levels_is_refused(path):
    calibration_file.save(path, 'a', THIRDS)
    with pytest.raises(StateError, match='must have 8 levels, like the design; got 2'):
        calibration_file.load(path, 'a', 8)


def test_a_file_that_cannot_be_read_or_written_is_reported(path, tmp_path):
    path.mkdir(parents=True)
    with pytest.raises(StateError, match=r'calibrations cannot be read from .*directory'):
        calibration_file.load(path, 'a', 2)
    (tmp_path / 'file').write_text('')
    with pytest.raises(StateError, match=r'cannot be (read|saved)'):
        calibration_file.save(tmp_path / 'file' / 'x.json', 'a', THIRDS)


# --- what a calibration depends on ------------------------------------------------------------


def test_the_key_depends_on_what_delays_depend_on():
    plain = calibration_key(CASE_II, Settings())
    assert plain == calibration_key(dataclasses.replace(CASE_II), Settings())
    others = {
        calibration_key(design, settings)
        for design, settings in (
            (CASE_I, Settings()),
            (dataclasses.replace(CASE_II, gamma=-1.3e-4), Settings()),
            (CASE_II, Settings(**rig.with_group('probe', v_th=1.7e-4))),
            (CASE_II, Settings(**rig.with_group('probe_right', window=5.0))),
            (CASE_II, Settings(time=TimeSettings(tick=10.0))),
        )
    }
    assert len(others | {plain}) == 6
    same = Settings(write=WriteSettings(attempts=7), read=ReadSettings(end='both'))
    assert calibration_key(CASE_II, same) == plain


def test_a_folder_that_cannot_be_made_is_reported(tmp_path):
    (tmp_path / 'folder').symlink_to(tmp_path / 'nowhere')
    with pytest.raises(StateError, match=r'the calibration cannot be saved in .*: File exists'):
        calibration_file.save(tmp_path / 'folder' / 'x.json', 'a', THIRDS)
