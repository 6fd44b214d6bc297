# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state file holds one exact snapshot, with a calibration; errors say what is wrong with it.
Nothing old replaces newer, nothing is calibrated twice.
"""

import dataclasses
import json
from contextlib import closing

import pytest
from timeouts import TIMEOUT_S

from mlmem import MemoryElement, Settings, factory, snapshot
from mlmem.moves.strain_cycle import WriteSettings
from mlmem.physics import CASE_I, CASE_II, StateError
from mlmem.readers.calibration import calibration_key
from mlmem.settings import ReadSettings, TimeSettings
from mlmem_ros.host import ThrottledLog, store
from mlmem_ros.host.settings import FileSettings, StateSettings
from mlmem_ros.host.worker import Worker
from test.device import rig


def open_store(file):
    """Open the store of a file; a file has one owner at a time."""
    settings = StateSettings(path=str(file), interval=0.0)
    throttled = ThrottledLog(lambda *_: None)
    return store.Store(settings, FileSettings(), throttled, Worker('test-store', throttled))


def test_link_leads_to_the_file_that_is_kept(file, tmp_path):
    link, element = tmp_path / 'link.json', MemoryElement(CASE_II)
    link.symlink_to(file)
    element.advance()
    with closing(open_store(link)) as kept:
        kept.save_state(element).result(TIMEOUT_S)
    assert link.is_symlink()
    assert store.load_snapshot(file)['ticks'] == 1
    loop = tmp_path / 'loop.json'
    loop.symlink_to(loop)
    with closing(open_store(loop)) as kept, pytest.raises(StateError, match=r'loop\.json'):
        kept.load_state()


def test_state_below_a_file_is_rejected(file):
    file.touch()
    store_below = open_store(file / 'element.json')
    with closing(store_below), pytest.raises(StateError, match='cannot be kept'):
        store_below.load_state()
    with pytest.raises(StateError, match='the state cannot be saved'):
        store.save_snapshot(file / 'element.json', {})


@pytest.mark.parametrize(
    'text', ['{"format": 1}', '{"format": 2, "snapshot": {}}', '{"format": 1, "snapshot": []}']
)
def test_file_of_another_format_is_rejected_and_kept(file, text):
    """What else is no state file is in test_hostile_files.py."""
    file.write_text(text)
    with pytest.raises(StateError, match=r'element\.json is damaged: '):
        store.load_snapshot(file)
    assert file.read_text() == text


# --- calibrations -----------------------------------------------------------------------------


def test_calibration_is_found_by_its_key():
    element = MemoryElement(CASE_II)
    taken = json.loads(json.dumps(snapshot.take_snapshot(element)))
    key = taken['calibration_key']
    assert store.find_calibration(taken, key, CASE_II.levels) == element.calibration
    for given, wanted, levels in ((None, key, 8), (taken, 'other', 8), (taken, key, 3)):
        assert store.find_calibration(given, wanted, levels) is None
    taken['calibration'] = {'left': 1}
    assert store.find_calibration(taken, key, CASE_II.levels) is None


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


def test_design_is_calibrated_once(serve, kept, parameters, calibration, monkeypatch):
    """By a probe or another; the file keeps the last calibration."""
    made, counts = [], []
    monkeypatch.setattr(factory, 'factory_calibration', lambda *_: made.append(1) or calibration)
    probe = dataclasses.replace(parameters.settings.probe_right, v_th=1e-3)
    other = dataclasses.replace(parameters.settings, probe_right=probe)
    for settings in (parameters.settings, parameters.settings, other):
        service = serve(settings=settings, **kept)
        service.activate(paused=True)
        service.host.close()
        counts.append(len(made))
    assert counts == [1, 1, 2]
