# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A state file holds one exact snapshot, with a calibration; errors say what is wrong with it.
Nothing old replaces newer, nothing is calibrated twice. Work that waits for its disk: in order,
answered once, within `WORK_TIMEOUT_S`; and its log: each subject once a second, in short lines, at
no cost.
"""

import dataclasses
import itertools
import json
import threading
from contextlib import closing

import pytest
import rig
from suite import TIMEOUT_S

from mlmem import MemoryElement, Settings, factory, snapshot, threads
from mlmem.moves.strain_cycle import WriteSettings
from mlmem.physics import CASE_I, CASE_II, StateError
from mlmem.readers.calibration import calibration_key
from mlmem.settings import ReadSettings, TimeSettings
from mlmem_ros.bag.errors import BagError
from mlmem_ros.host import Overdue, ThrottledLog, store
from mlmem_ros.host.settings import FileSettings, StateSettings
from mlmem_ros.host.worker import WORK_TIMEOUT_S, Worker


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


# --- the worker and its log --------------------------------------------------------------------


@pytest.fixture
def worker(throttled):
    return Worker('test', throttled)


@pytest.fixture
def disk():
    """A disk that hangs until the test lets it go on."""
    hung = threading.Event()
    yield hung
    hung.set()


def test_worker_does_jobs_in_order(worker, disk):
    done = []
    worker.do('work', disk.wait)
    answers = [worker.do('work', lambda n=n: done.append(n) or n) for n in range(50)]
    disk.set()
    assert [answer.result(TIMEOUT_S) for answer in answers] == list(range(50)) == done
    assert worker.wait(TIMEOUT_S)
    for thread in threading.enumerate():
        if thread.name == 'test':
            thread.join(TIMEOUT_S)
            assert not thread.is_alive()
    assert worker.do('more', lambda: 'again').result(TIMEOUT_S) == 'again'


def test_defects_of_a_job_are_logged_and_errors_returned(worker, throttled, log):
    def fail(error):
        raise error

    refused = worker.do('work', lambda: fail(BagError('the disk is full')))
    assert str(refused.exception(TIMEOUT_S)) == 'the disk is full'
    assert throttled.caught == 0
    defect = worker.do('work', lambda: fail(KeyError('views')))
    assert isinstance(defect.exception(TIMEOUT_S), KeyError)
    assert worker.wait(TIMEOUT_S)
    assert throttled.caught == 1
    assert 'work failed; this is a fault in the software' in log.of('ERROR')[0]


def test_job_on_a_hanging_disk_times_out(worker, disk, monkeypatch):
    hung = worker.do('writing', disk.wait)
    behind = worker.do('closing', lambda: pytest.fail('nobody waits for it any more'))
    worker.on_timer()
    assert not hung.done()
    now = threads.monotonic
    monkeypatch.setattr(threads, 'monotonic', lambda: now() + WORK_TIMEOUT_S)
    worker.on_timer()
    for answer, what in ((hung, 'writing'), (behind, 'closing')):
        with pytest.raises(Overdue, match=f'{what} takes longer than 10 s: the disk does not'):
            answer.result(0.0)
    disk.set()
    assert worker.wait(TIMEOUT_S)
    assert worker.do('more', lambda: 'again').result(TIMEOUT_S) == 'again'


def test_flood_of_one_subject_is_one_line_a_second(throttled, log, monkeypatch):
    clock = itertools.count(0, 1)  # a thousand a second
    monkeypatch.setattr(threads, 'monotonic', lambda: next(clock) / 1024)
    for _ in range(10 * 1024):
        throttled.refused('~/strain', 'it is not finite')
    assert throttled.refusals == 10 * 1024
    told = log.of('WARN')
    assert len(told) == 10 + 9
    assert set(told[:10]) == {'~/strain refused: it is not finite'}
    more = told[11].removeprefix('~/strain refused: it is not finite ')
    assert more == '(and 1023 more since the last line)'


def test_log_line_is_short_whatever_came_in(throttled, log):
    throttled.refused(
        '~/strain_trajectory', f'the joint must be substrate; got {"j" * 5_000_000}!'
    )
    (told,) = log.of('WARN')
    assert len(told) < 520
    assert told.startswith('~/strain_trajectory refused: the joint must be substrate')
    assert told.endswith('jjj!')
