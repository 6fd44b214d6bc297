# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder loses nothing silently and never disturbs its producer."""

import threading
import time

import pytest
from timeouts import TIMEOUT_S

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.host import SessionPlan
from mlmem_ros.host.recording import BagRecording
from mlmem_ros.host.settings import RecordSettings

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
