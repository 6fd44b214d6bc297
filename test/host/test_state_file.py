# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state file holds one exact snapshot, with a calibration; errors say what is wrong with it."""

import dataclasses
import json
import tracemalloc

import pytest

from mlmem import MemoryElement, Settings, snapshot
from mlmem.moves.strain_cycle import WriteSettings
from mlmem.physics import CASE_I, CASE_II, StateError
from mlmem.readers.calibration import calibration_key
from mlmem.settings import ReadSettings, TimeSettings
from mlmem_ros.host import store
from test.device import rig


@pytest.mark.parametrize(
    'text',
    [
        '', '\xff', '[' * 100_000, '{"format": 1, "snap', '[]', '{"format": 1}',
        '{"format": 2, "snapshot": {}}', '{"format": 1, "snapshot": []}',
    ],
)  # fmt: skip
def test_damaged_file_is_rejected_and_kept(tmp_path, text):
    path = tmp_path / 'element.json'
    path.write_bytes(text.encode('latin-1'))
    with pytest.raises(StateError, match=r'element\.json is damaged: '):
        store.load_snapshot(path)
    assert path.read_bytes() == text.encode('latin-1')


def test_huge_file_is_rejected_in_little_memory(tmp_path):
    """50 GB of zeros, which take no room on the disk."""
    path = tmp_path / 'element.json'
    with path.open('wb') as file:
        file.truncate(50 * 10**9)
    tracemalloc.start()
    try:
        with pytest.raises(StateError, match='is damaged: it is larger than 33554432 bytes'):
            store.load_snapshot(path)
        assert tracemalloc.get_traced_memory()[1] < 80e6  # twice what is read
    finally:
        tracemalloc.stop()


def test_calibration_is_found_by_its_key():
    element = MemoryElement(CASE_II)
    taken = json.loads(json.dumps(snapshot.take_snapshot(element)))
    key = taken['calibration_key']
    assert store.find_calibration(taken, key, CASE_II.levels) == element.calibration
    for given, wanted, levels in ((None, key, 8), (taken, 'other', 8), (taken, key, 3)):
        assert store.find_calibration(given, wanted, levels) is None
    taken['calibration'] = {'left': 1}
    assert store.find_calibration(taken, key, CASE_II.levels) is None


def test_file_that_cannot_be_read_or_written_is_reported(tmp_path):
    with pytest.raises(StateError, match=r'the state cannot be read from .*directory'):
        store.load_snapshot(tmp_path)
    (tmp_path / 'file').write_text('')
    with pytest.raises(StateError, match='the state cannot be saved'):
        store.save_snapshot(tmp_path / 'file' / 'x.json', {})


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
