# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element in service: acknowledged writes are safe, every request is answered, failures end.

The disk is real; where it has to fail or hang, a function replaces it.
"""

import dataclasses
import re
import shutil
import threading
import time

import pytest
from lines import make_failing_driver, raising
from suite import TIMEOUT_S, expect_rejection

from mlmem import (
    Disturb,
    Driver,
    DriverError,
    End,
    Faults,
    Read,
    Refused,
    SetFaults,
    SetStrain,
    Settings,
    SettingsError,
    Write,
)
from mlmem.loop.mailbox import MAX_PENDING_REQUESTS
from mlmem.loop.timetable import SteadyPacer
from mlmem.physics import CASE_I, CASE_II, StateError
from mlmem_ros.bag.errors import BagError
from mlmem_ros.host import design_check, recording, store, worker
from mlmem_ros.host.design_check import check_design
from mlmem_ros.host.settings import DeviceSettings, QueueSettings, RecordSettings
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools import checks
from mlmem_tools.checks import Finding, Report, Verdict

# --- what is acknowledged is safe -------------------------------------------------------------


def test_write_is_saved_before_the_next_command(serve, file, kept):
    """Though five have arrived meanwhile."""
    host = serve(**kept).activate()
    host.pause(True).result(TIMEOUT_S)
    write = host.submit(Write(0))
    host.step().answer.result(TIMEOUT_S)
    for _ in range(5):
        host.submit(SetStrain(0.0))
    host.pause(False)
    outcome = write.answer.result(TIMEOUT_S)
    assert outcome.success
    assert store.load_snapshot(file)['ticks'] == outcome.end_tick + 1


def fill_disk(path, taken):
    raise StateError(reason='the state cannot be saved: No space left on device')


def test_write_that_cannot_be_saved_fails(serve, kept, monkeypatch):
    host = serve(**kept).activate()
    monkeypatch.setattr(store, 'save_snapshot', fill_disk)
    outcome = host.submit(Write(0)).answer.result(TIMEOUT_S)
    assert not outcome.success
    assert outcome.reading.level == 0
    assert outcome.error.startswith('write succeeded, but is not saved: the state cannot be saved')
    assert outcome.code == 'failed'
    assert host.submit(Read()).answer.result(TIMEOUT_S).success  # a read saves nothing


def test_hanging_disk_delays_no_answer_and_is_a_loss_at_the_end(serve, kept, monkeypatch, log):
    monkeypatch.setattr(worker, 'WORK_TIMEOUT_S', 0.2)
    monkeypatch.setattr(worker.Worker.wait, '__defaults__', (0.2,))
    disk = threading.Event()
    host = serve(**kept).activate()
    monkeypatch.setattr(store, 'save_snapshot', lambda *_: disk.wait())
    answer = host.submit(Write(0)).answer
    while not answer.done():
        host.on_timer()  # as its node calls it
        time.sleep(1e-3)
    assert 'the disk does not answer' in answer.result().error
    assert host.submit(Read()).answer.result(TIMEOUT_S).success
    host.close()
    assert host.lost
    assert any('the disk does not answer' in text for text in log.of('ERROR'))
    disk.set()


def test_later_save_clears_an_earlier_failure(serve, file, kept, monkeypatch):
    """The exit status tells of the content as it is."""
    service = serve(**kept)
    host = service.activate()
    assert host.submit(Write(0)).answer.result(TIMEOUT_S).success
    with monkeypatch.context() as patch:
        patch.setattr(store, 'save_snapshot', fill_disk)
        host.deactivate()
    assert host.lost
    host.release_device()
    service.activate()
    host.close()
    assert not host.lost
    assert store.load_snapshot(file)['reading']['level'] == 0


def test_second_element_on_a_state_file_is_rejected(serve, kept):
    first, second = serve(**kept), serve(**kept)
    host = first.activate()
    with pytest.raises(StateError, match=r'element\.json is in use by /mlmem \(process \d+\)'):
        second.activate()
    assert host.submit(Write(0)).answer.result(TIMEOUT_S).success
    host.close()
    assert second.activate().submit(Read()).answer.result(TIMEOUT_S).reading.level == 0


# --- a device that fails ----------------------------------------------------------------------


def test_failed_device_is_released_and_its_file_kept(serve, kept, file, log):
    service = serve(**kept)
    host = service.activate()
    assert host.submit(Write(0)).answer.result(TIMEOUT_S).success
    before = store.load_snapshot(file)
    service.poison()
    with expect_rejection(Refused, 'inactive'):
        host.submit(Read()).answer.result(TIMEOUT_S)
    host.release_failed()
    assert host.element is None
    assert host.loop is None
    with pytest.raises(Refused, match=r'^inactive: the device has stopped: .*; conf') as caught:
        host.submit(Read()).answer.result(TIMEOUT_S)
    assert caught.value.code == 'inactive'
    assert store.load_snapshot(file)['reading'] == before['reading']
    assert any('configure and activate to go on' in text for text in log.of('ERROR'))
    assert service.activate().submit(Read()).answer.result(TIMEOUT_S).reading.level == 0


@pytest.fixture
def failed(serve, log):
    """An element in service whose loop has failed after a write; it has no state file."""
    service, pacer = serve(), SteadyPacer()
    host = service.activate(pacer)
    assert host.submit(Write(0)).answer.result(TIMEOUT_S).success
    assert host.submit(SetStrain(0.01)).answer.result(TIMEOUT_S) is None
    pacer.now = lambda: 1 / 0
    assert service.failed.wait(TIMEOUT_S)
    element = host.element
    host.release_failed()
    assert element.actuator.strain == 0.0
    assert any('kept until the next configuration' in text for text in log.of('ERROR'))
    return service


def test_failed_loop_keeps_the_content(failed):
    assert failed.activate().submit(Read()).answer.result(TIMEOUT_S).reading.level == 0


def test_content_of_a_failed_device_stays_with_its_design(failed, log):
    shorter = dataclasses.replace(failed.given.design, N=224)
    failed.host.adopt_device(
        failed.host.prepare_device(dataclasses.replace(failed.given, design=shorter))
    )
    assert log.of('WARN') == ['the failed device had another design: the element is blank']


def test_listener_that_fails_stops_nothing(serve, log):
    service = serve()
    service.events = type('Full', (list,), {'extend': lambda *_: 1 / 0})()
    host = service.activate()
    assert host.submit(Write(0)).answer.result(TIMEOUT_S).success
    assert host.log.caught > 0
    told = log.of('ERROR')[0]
    assert told.startswith('publishing failed; this is a fault in the software:')
    assert "{'extend': lambda *_: 1 / 0}" in told  # the traceback


class Sour(Driver):
    """A driver of a user's own, which raises where its address says."""

    def __new__(cls, design, settings, address):
        return make_failing_driver(address, raising(LookupError('turned sour')))


@pytest.mark.parametrize('where', ['opening', 'playing', 'closing'])
def test_exception_of_a_driver_is_logged(serve, log, where):
    service = serve(device=DeviceSettings(f'{__name__}:Sour', where))
    if where == 'opening':
        with pytest.raises(DriverError, match='failed while opening: LookupError'):
            service.activate()
    else:
        host = service.activate()
    if where == 'playing':
        with pytest.raises(Refused, match=r'the device has stopped: .*turned sour'):
            host.submit(Write(0)).answer.result(TIMEOUT_S)
        host.release_failed()
    elif where == 'closing':
        host.close()
    (trace,) = [line for line in log.of('ERROR') if 'Traceback' in line]
    assert 'LookupError: turned sour' in trace
    assert f'failed while {where}: ' in trace


def test_exception_of_a_driver_module_is_logged(serve, log, tmp_path, monkeypatch):
    (tmp_path / 'sour.py').write_text('1 / 0\n')
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SettingsError, match='sour cannot be imported: ZeroDivisionError'):
        serve(device=DeviceSettings('sour:Bench')).activate()
    assert any('sour.py", line 1' in line for line in log.of('ERROR'))


# --- recording --------------------------------------------------------------------------------


@pytest.fixture
def record(tmp_path):
    return RecordSettings(path=str(tmp_path / 'session'))


@pytest.mark.parametrize('active', [False, True])
def test_time_is_added_to_a_path_that_exists(serve, record, tmp_path, active):
    """At activation and while it runs; existing files stay as they are."""
    (tmp_path / 'session').mkdir()
    service = serve(record=RecordSettings() if active else record)
    host = service.activate()
    if active:
        service.record(record).result(TIMEOUT_S)
    path = host.record(None).result(TIMEOUT_S)
    assert path.parent == tmp_path
    assert re.fullmatch(r'session-\d{8}-\d{6}', path.name)
    assert run_replay(load_session(path)).exact
    assert not any((tmp_path / 'session').iterdir())


def test_session_with_faults_and_shaking_replays(serve, record):
    """With faults from the start, faults that change and a base that moves during a write."""
    faults = Faults(disorder_alpha=2e-5, sensor_noise=1e-6, actuator_lag=30.0)
    host = serve(record=record, faults=faults).activate()
    host.pause(True).result(TIMEOUT_S)
    write = host.submit(Write(1)).answer
    host.step(5).answer.result(TIMEOUT_S)
    host.set_faults(dataclasses.replace(faults, weak_cell=90, weak_factor=0.98))
    host.submit(Disturb(1e-7))
    host.step(5).answer.result(TIMEOUT_S)
    assert not write.done()
    host.pause(False)
    assert write.result(TIMEOUT_S).success
    session = load_session(host.record(None).result(TIMEOUT_S))
    kinds = [type(command) for _, command in session.stamped]
    assert kinds == [SetFaults, Write, SetFaults, Disturb]
    report = run_replay(session)
    assert (report.exact, report.refused) == (True, [])


def test_session_that_a_procedure_prevents_leaves_no_bag(serve, record, monkeypatch, tmp_path):
    """The procedure begins while the bag opens."""
    service = serve()
    host = service.activate()
    host.pause(True).result(TIMEOUT_S)
    made = recording.open_bag

    def open_late(plan):
        host.submit(Write(0))
        host.step().answer.result(TIMEOUT_S)
        return made(plan)

    monkeypatch.setattr(recording, 'open_bag', open_late)
    for _ in range(2):  # the second time it runs before
        with pytest.raises(Refused, match='write is running'):
            service.record(record).result(TIMEOUT_S)
        monkeypatch.setattr(recording, 'open_bag', made)
    assert host.sessions.current is None
    assert not list(tmp_path.iterdir())


def test_stop_of_a_failed_recording_reports_the_failure(serve, record):
    service = serve()
    host = service.activate()
    path = service.record(dataclasses.replace(record, sync_interval=0.0)).result(TIMEOUT_S)
    while path.exists():  # it is written to at the same time
        shutil.rmtree(path, ignore_errors=True)
    while host.sessions.current.error is None:
        assert host.submit(SetStrain(0.0)).answer.result(TIMEOUT_S) is None
    with pytest.raises(BagError, match=r'was deleted while being written|No such file'):
        host.record(None).result(TIMEOUT_S)
    assert host.sessions.current is None
    assert host.submit(Read()).answer.result(TIMEOUT_S).success


# --- its life ---------------------------------------------------------------------------------


def test_request_to_an_inactive_host_is_rejected(serve, record):
    service = serve()
    host = service.host
    for answer in (
        host.submit(Read()).answer, host.step().answer, host.pause(True),
        service.record(record), host.record(None),
        host.submit_made(lambda element: Read()).answer,
    ):  # fmt: skip
        with expect_rejection(Refused, 'inactive'):
            answer.result(0.0)
    host.set_speed(2.0)
    host.set_faults(Faults(sensor_noise=1e-6))
    host.on_timer()
    host.close()


@pytest.mark.parametrize('most', [0, 3])
def test_host_with_a_full_queue_rejects_at_once(serve, most):
    """What waits is done in its order; what could not be done either way is said to be wrong."""
    host = serve(queue=QueueSettings(most=most)).activate()
    host.pause(True).result(TIMEOUT_S)
    writes = [host.submit(Write(level), TIMEOUT_S).answer for level in range(most + 1)]
    late = [host.submit(command, TIMEOUT_S).answer for command in (Read(), Write(8))]
    host.step().answer.result(TIMEOUT_S)
    for answer, code in zip(late, ('busy', 'out_of_range'), strict=True):
        with pytest.raises(Refused) as refused:
            answer.result(TIMEOUT_S)
        assert refused.value.code == code
    host.pause(False)
    outcomes = [write.result(TIMEOUT_S) for write in writes]
    assert [outcome.reading.level for outcome in outcomes] == [*range(most + 1)]
    begun = [outcome.start_tick for outcome in outcomes]
    assert begun == sorted(begun)


def test_initial_content_of_a_simulated_element_is_read(serve):
    service = serve(initial_content=8)
    with pytest.raises(SettingsError, match='initial_content'):
        service.host.prepare_device(service.given)
    service = serve(initial_content=5)
    service.activate()
    assert service.host.element.reading is None
    assert service.host.submit(Read()).answer.result(TIMEOUT_S).reading.level == 5


def test_parameter_whose_command_is_refused_is_counted(serve):
    """Nobody waits for its answer: a queue that is full is all that can refuse it."""
    host = serve().activate()
    host.pause(True).result(TIMEOUT_S)
    for _ in range(MAX_PENDING_REQUESTS):
        host.submit(SetStrain(0.0))
    host.set_faults(Faults(sensor_noise=1e-6))
    host.set_method('strain')
    assert host.log.refusals == 2


# --- a design is checked before it is built, once in a process --------------------------------


def test_findings_are_kept_for_the_next_process(monkeypatch, tmp_path):
    """Until a file that it depends on has changed; a damaged file of checks is ignored."""
    checked = []

    def check(design, settings):
        checked.append(design)
        found = (
            Finding('mass', {'m': 1.0}, '', Verdict.PASS, 'text'),
            Finding('carrier', {}, '', Verdict.WARN, 'text'),
            Finding('read_disturb', {'left': 0.25}, '', Verdict.PASS, 'text'),
        )
        return Report(found)

    def asked_anew(design):
        design_check.load_findings.cache_clear()
        before = len(checked)
        warned, disturb = design_check.load_findings(design, Settings())
        assert tuple(warned) == ('carrier', 'warn', 'text', {})
        assert tuple(disturb) == ('read_disturb', 'pass', 'text', {'left': 0.25})
        return len(checked) > before

    monkeypatch.setattr(checks, 'check', check)
    monkeypatch.setattr(design_check, 'find_cache_folder', lambda: tmp_path)
    assert [asked_anew(design) for design in (CASE_II, CASE_II, CASE_I)] == [True, False, True]
    with monkeypatch.context() as changed:
        changed.setattr(design_check, '_hash_source', lambda: 'changed')
        assert asked_anew(CASE_II)
    assert not asked_anew(CASE_II)
    for damaged in ('{', '[1]'):
        for path in tmp_path.iterdir():
            path.write_text(damaged)
        assert asked_anew(CASE_II)
    design_check.load_findings.cache_clear()


def test_check_gives_the_loudest_safe_pulses(throttled, monkeypatch):
    found = [('mass', 'pass', 'text', {'m': 1.0}), ('read_disturb', 'pass', 'text', {'left': 0.2})]
    monkeypatch.setattr(design_check, 'load_findings', lambda *_: found)
    assert check_design(CASE_II, Settings(), 'refuse', throttled) == {End.LEFT: 0.2}
    assert check_design(CASE_II, Settings(), 'skip', throttled) == {}
