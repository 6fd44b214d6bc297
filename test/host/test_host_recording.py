# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a host records replays to the bit, from the last seconds before a request or a failure on,
and every file alone; the recorder loses nothing silently and never disturbs its producer.
"""

import threading
import time
from collections import Counter

import pytest
from suite import TIMEOUT_S, expect_rejection

from mlmem import Read, Refused, SetStrain, Write
from mlmem_ros.bag import jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.host import SessionPlan, recording
from mlmem_ros.host.recording import BagRecording
from mlmem_ros.host.settings import RecordSettings
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay

LONG = RecordSettings(last_seconds=3600.0)
SHORT = RecordSettings(last_seconds=0.2, hash_every=10)
"""A write takes longer: 0.2 s are 200 ticks."""


def recorded(service, path):
    """Record for a moment; return the session."""
    host = service.host
    bag = service.record(RecordSettings(path=str(path))).result(TIMEOUT_S)
    host.record(None).result(TIMEOUT_S)
    with expect_rejection(Refused, 'conflict'):  # nothing is being recorded
        host.record(None).result(TIMEOUT_S)
    return load_session(bag)


def begun(session):
    """Return the tick with which a session begins."""
    return session.header.initial['ticks']


def commands(session):
    return [command for _, command in session.stamped]


def test_session_begins_with_the_last_seconds(serve, tmp_path):
    """Also after one that could not be written."""
    service = serve(record=LONG)
    host = service.activate()
    assert host.submit(Write(5)).answer.result(TIMEOUT_S).success
    (tmp_path / 'file').touch()
    with pytest.raises(BagError):
        recorded(service, tmp_path / 'file' / 'session')
    reading = host.submit(Read()).answer  # a session may begin while a procedure runs
    path = service.record(RecordSettings(str(tmp_path / 'session'))).result(TIMEOUT_S)
    assert reading.result(TIMEOUT_S).reading.level == 5
    assert host.record(None).result(TIMEOUT_S) == path
    session = load_session(path)
    assert begun(session) == 0
    assert commands(session) == [Write(5), Read()]
    report = run_replay(session)
    assert report.exact
    assert [outcome.reading.level for outcome in report.outcomes] == [5, 5]


def test_last_seconds_before_a_failure_are_saved(serve, tmp_path, monkeypatch, log):
    monkeypatch.chdir(tmp_path)
    service = serve(record=LONG)
    host = service.activate()
    assert host.submit(Write(2)).answer.result(TIMEOUT_S).success
    assert host.submit(SetStrain(0.01)).answer.result(TIMEOUT_S) is None
    service.poison()
    host.release_failed()
    (bag,) = tmp_path.glob('session-*')
    assert any(str(bag) in line for line in log.of('INFO'))
    session = load_session(bag)
    assert commands(session) == [Write(2), SetStrain(0.01)]
    report = run_replay(session)
    assert report.exact
    assert report.outcomes[0].reading.level == 2
    assert host.recording is None


def test_old_seconds_are_dropped_and_a_write_kept_whole(serve, tmp_path):
    service = serve(record=SHORT)
    host = service.activate()
    for level in (1, 6):
        assert host.submit(Write(level)).answer.result(TIMEOUT_S).success
    session = recorded(service, tmp_path / 'written')
    (outcome,) = run_replay(session).outcomes
    assert outcome.reading.level == 6
    assert 0 <= outcome.start_tick - begun(session) <= 250 + 50
    idle = max(each.tick for each in session.hashes) + 600
    while host.element.ticks < idle:
        host.loop.call(lambda: None).result(TIMEOUT_S)
    assert 0.2 <= host.sessions.buffer.kept['last_seconds'] <= 0.32
    session = recorded(service, tmp_path / 'idle')
    assert session.stamped == []
    assert begun(session) >= idle - 320
    assert run_replay(session).exact


def test_memory_of_the_last_seconds_is_limited(serve, tmp_path, monkeypatch):
    """A write fills more than the limit: what is kept begins after it."""
    monkeypatch.setattr(recording.PreTriggerBuffer, 'max_bytes', 20_000)
    service = serve(record=RecordSettings(last_seconds=3600.0, hash_every=50))
    host = service.activate()
    ended = host.submit(Write(1)).answer.result(TIMEOUT_S).end_tick
    assert host.submit(Read()).answer.result(TIMEOUT_S).success
    host.pause(True).result(TIMEOUT_S)
    assert host.sessions.buffer.kept['last_bytes'] <= 20_000
    session = recorded(service, tmp_path / 'session')
    assert begun(session) >= ended
    assert run_replay(session).exact


# --- split recordings --------------------------------------------------------------------------


def record_until_split(service, path):
    """Write and read until a recording has two full files; return the closed bag."""
    host = service.host
    settings = RecordSettings(str(path), sync_interval=0.02, max_bytes=4_000, hash_every=20)
    bag = service.record(settings).result(TIMEOUT_S)
    for number in range(200):
        if host.sessions.current.full_files >= 2:
            break
        assert host.submit(Write(3 * number % 8)).answer.result(TIMEOUT_S).success
        assert host.submit(Read()).answer.result(TIMEOUT_S).success
    assert host.record(None).result(TIMEOUT_S) == bag
    assert host.log.caught == 0  # no file begins while a procedure runs
    return bag


@pytest.mark.parametrize('last_seconds', [0.0, 3600.0], ids=['', 'last seconds'])
def test_each_file_of_a_split_recording_replays_alone(serve, tmp_path, last_seconds):
    service = serve(record=RecordSettings(last_seconds=last_seconds, hash_every=20))
    host = service.activate()
    assert host.submit(Write(5)).answer.result(TIMEOUT_S).success
    bag = record_until_split(service, tmp_path / 'session')
    whole = load_session(bag)
    report = run_replay(whole)
    assert report.exact
    assert report.whole
    first_topics = {next(iter(BagReader(file))).topic for file in bag.glob('*.mcap')}
    assert first_topics == {'/mlmem/session'}
    stamped, hashes, events = [], [], Counter()
    for part in range(len(list(bag.glob('*.mcap')))):
        session = load_session(bag / f'session_{part}.mcap')
        alone = run_replay(session)
        assert (alone.exact, alone.refused) == (True, [])
        assert alone.missing_parts == tuple(range(part))
        events.update({name: each.equal for name, each in alone.events.items()})
        stamped += session.stamped
        hashes += [each.tick for each in session.hashes]
    assert part >= 2
    assert stamped == whole.stamped
    assert hashes == [each.tick for each in whole.hashes]
    assert events == {name: each.equal for name, each in report.events.items()}


def test_no_file_begins_while_the_disk_is_too_slow(serve, tmp_path, monkeypatch):
    """The state of the device, which takes milliseconds, is not taken for a queue that is full."""
    service = serve()
    host = service.activate()
    monkeypatch.setattr(BagRecording, 'has_margin', False)
    settings = RecordSettings(path=str(tmp_path / 'session'), sync_interval=0.0, max_bytes=1024)
    bag = service.record(settings).result(TIMEOUT_S)
    for level in (3, 5):
        assert host.submit(Write(level)).answer.result(TIMEOUT_S).success
    host.record(None).result(TIMEOUT_S)
    assert len(list(bag.glob('*.mcap'))) == 1
    assert run_replay(load_session(bag)).exact


# --- the recorder ------------------------------------------------------------------------------

TOPIC = '/mlmem/session/dropped'


def level(i):
    return jazzy.encode_message('std_msgs/msg/Int16', data=i % 1000)


@pytest.fixture
def make(tmp_path, throttled):
    """Start a recorder of one topic; it is closed after the test."""
    recorders = []

    def make(sync_interval=0.0):
        writer = BagWriter(tmp_path / 'bag')
        writer.add_topic('/level', 'std_msgs/msg/Int16')
        writer.add_topic(TOPIC, 'std_msgs/msg/UInt64')
        plan = SessionPlan('/mlmem', RecordSettings(sync_interval=sync_interval))
        recorders.append(BagRecording(plan, throttled, time.time_ns, writer, ()))
        return recorders[-1]

    yield make
    for recorder in recorders:
        recorder.close()


def hold(recorder, monkeypatch):
    """Stall the disk: the first write waits until the returned event is set."""
    released, stalled = threading.Event(), threading.Event()
    write = BagWriter.write

    def slow(*args):
        stalled.set()
        released.wait(TIMEOUT_S)
        write(*args)

    monkeypatch.setattr(BagWriter, 'write', slow)
    recorder.keep_message(('/level', level(0), 0))
    assert stalled.wait(TIMEOUT_S)
    return released


def wait_for(condition):
    deadline = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_queued_messages_are_all_in_the_bag(make):
    recorder = make(sync_interval=0.1)
    assert all(recorder.keep_message(('/level', level(i), i)) for i in range(1000))
    recorder.close()
    assert (recorder.state, recorder.messages, recorder.dropped) == ('closed', 1000, 0)
    assert (recorder.queued, recorder.error) == (0, None)
    reader = BagReader(recorder.path)
    assert [(m.log_time, m.cdr) for m in reader] == [(i, level(i)) for i in range(1000)]
    assert reader.topics[TOPIC].message_count == 0  # stands there, and says: nothing dropped


def test_idle_recording_is_synced(make):
    recorder = make(sync_interval=0.05)
    recorder.keep_message(('/level', level(1), 1))
    wait_for(lambda: [m.cdr for m in BagReader(recorder.path)] == [level(1)])
    assert recorder.state == 'recording'


@pytest.mark.parametrize(
    ('limit', 'most', 'fitting'), [('max_messages', 10, 10), ('max_bytes', 100, 16)]
)
def test_overflow_is_counted_and_recorded(make, monkeypatch, limit, most, fitting):
    """Each message has 6 bytes."""
    monkeypatch.setattr(BagRecording, limit, most)
    recorder = make()
    released = hold(recorder, monkeypatch)
    taken = [recorder.keep_message(('/level', level(i), i)) for i in range(1, fitting + 6)]
    assert taken == [True] * fitting + [False] * 5
    assert (recorder.dropped, recorder.queued) == (5, fitting)
    released.set()
    recorder.close()
    assert recorder.dropped == 5
    reader = BagReader(recorder.path)
    found = [m.cdr for m in reader.session_messages(['/level'])]
    assert found == [level(i) for i in range(fitting + 1)]
    (count,) = reader.session_messages([TOPIC])
    assert reader.deserialize(count).data == 5
    assert count.log_time == fitting + 5  # that of the last message that is missing


def test_defect_that_occurs_again_at_the_end_is_reported(make, monkeypatch, log):
    recorder = make()
    monkeypatch.setattr(BagWriter, 'write', lambda *_: 1 / 0)
    monkeypatch.setattr(BagWriter, 'close', lambda *_: 1 / 0)
    recorder.keep_message(('/level', level(1), 1))
    wait_for(lambda: recorder.state == 'failed')
    recorder.close()
    assert log.of('ERROR') == [f'recording stopped: {recorder.error}']


@pytest.mark.parametrize(
    ('item', 'reason'),
    [
        (('/none', b'', 0), "bag: KeyError('/none')."),
        (('/level', b'', 'now'), 'bag: TypeError('),
        (('/level', b'', -1), 'from 0 to'),
    ],
)
def test_failed_write_ends_the_recording_and_nothing_else(make, item, reason, log):
    """What came before is whole."""
    recorder = make()
    recorder.keep_message(('/level', level(1), 1))
    wait_for(lambda: recorder.messages == 1)
    recorder.keep_message(item)
    wait_for(lambda: recorder.state == 'failed')
    assert isinstance(recorder.error, BagError)
    assert reason in str(recorder.error)
    assert recorder.keep_message(('/level', level(3), 3)) is False
    recorder.close()
    assert log.of('ERROR') == [f'recording stopped: {recorder.error}']
    reader = BagReader(recorder.path)
    assert [m.cdr for m in reader] == [level(1)]
    assert reader.losses == ()
