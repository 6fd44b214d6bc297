# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state file holds one exact snapshot, the file beside it calibrations by design and settings;
errors say what is wrong with a file.
"""

import dataclasses
import json

import pytest

from mlmem import Calibration, DelayTable, Settings
from mlmem.move_settings import WriteSettings
from mlmem.physics import CASE_I, CASE_II, StateError
from mlmem.readers.calibration import calibration_key
from mlmem.settings import ReadSettings, TimeSettings
from mlmem_ros.host import state_file
from test.device import rig


@pytest.mark.parametrize(
    'load', [state_file.load_snapshot, lambda path: state_file.load_calibration(path, 'a', 2)]
)
@pytest.mark.parametrize(
    'text',
    [
        '', '{"format": 1, "snap', '[]', '{"format": 1}',
        '{"format": 2, "snapshot": {}, "calibrations": {}}',
        '{"format": 1, "snapshot": [], "calibrations": []}',
        '{"format": 1, "calibrations": {"a": {}}}',
        '{"format": 1, "calibrations": {"a": {"left": 1, "right": 2}}}',
    ],
)  # fmt: skip
def test_damaged_file_is_rejected_and_kept(tmp_path, load, text):
    path = tmp_path / 'element.json'
    path.write_text(text)
    with pytest.raises(StateError, match=r'element\.json is damaged: '):
        load(path)
    assert path.read_text() == text


THIRDS = Calibration(DelayTable((1 / 3, 2 / 3)), DelayTable((2.0, 1.0), blank=0.1 + 0.2))
OTHER = Calibration(DelayTable((1.0, 2.0)), DelayTable((2.0, 1.0)))


@pytest.fixture
def path(tmp_path):
    return state_file.calibration_path(tmp_path / 'folder' / 'element.json')


def test_calibration_is_loaded_to_the_bit_by_its_key(path):
    assert state_file.load_calibration(path, 'a', 2) is None
    state_file.save_calibration(path, 'a', THIRDS)
    state_file.save_calibration(path, 'b', OTHER)
    assert state_file.load_calibration(path, 'a', 2) == THIRDS
    assert state_file.load_calibration(path, 'b', 2) == OTHER
    assert state_file.load_calibration(path, 'c', 2) is None
    with pytest.raises(StateError, match='damaged'):
        state_file.load_calibration(path, 'a', 3)  # levels
    state_file.save_calibration(path, 'a', OTHER)
    assert state_file.load_calibration(path, 'a', 2) == OTHER


def test_oldest_calibrations_are_dropped(path):
    for number in range(state_file.MAX_CALIBRATIONS + 2):
        state_file.save_calibration(path, str(number), OTHER)
        state_file.save_calibration(path, 'a', THIRDS)  # kept young
    kept = json.loads(path.read_text())['calibrations']
    assert len(kept) == state_file.MAX_CALIBRATIONS
    assert '2' not in kept
    assert '3' in kept
    assert state_file.load_calibration(path, 'a', 2) == THIRDS


def test_file_that_cannot_be_read_or_written_is_reported(path, tmp_path):
    path.mkdir(parents=True)
    with pytest.raises(StateError, match=r'calibrations cannot be read from .*directory'):
        state_file.load_calibration(path, 'a', 2)
    (tmp_path / 'file').write_text('')
    with pytest.raises(StateError, match=r'cannot be (read|saved)'):
        state_file.save_calibration(tmp_path / 'file' / 'x.json', 'a', THIRDS)


# --- what a calibration depends on ------------------------------------------------------------


def test_calibration_key_depends_on_what_delays_depend_on():
    plain = calibration_key(CASE_II, Settings())
    assert plain == calibration_key(dataclasses.replace(CASE_II), Settings())
    others = {
        calibration_key(design, settings)
        for design, settings in (
            (CASE_I, Settings()),
            (dataclasses.replace(CASE_II, gamma=-1.3e-4), Settings()),
            (CASE_II, rig.change(Settings(), probe={'v_th': 1.7e-4})),
            (CASE_II, rig.change(Settings(), probe_right={'window': 5.0})),
            (CASE_II, Settings(time=TimeSettings(tick=10.0))),
        )
    }
    assert len(others | {plain}) == 6
    same = Settings(write=WriteSettings(attempts=7), read=ReadSettings(end='both'))
    assert calibration_key(CASE_II, same) == plain
