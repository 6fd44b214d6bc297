# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The last seconds before a request or a failure are in the session and replay to the bit."""

import pytest
from rejection import expect_rejection
from timeouts import TIMEOUT_S

from mlmem import Read, Refused, SetStrain, Write
from mlmem_ros.bag.errors import BagError
from mlmem_ros.host import recording
from mlmem_ros.host.settings import RecordSettings
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay

LONG = RecordSettings(last_seconds=3600.0)
SHORT = RecordSettings(last_seconds=0.2, hash_every=10)
"""A write takes longer: 0.2 s are 200 ticks."""


def recorded(service, path):
    """Record for a moment; return the session."""
    host = service.host
    bag = host.record(service.plan(RecordSettings(path=str(path)))).result(TIMEOUT_S)
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
    plan = service.plan(RecordSettings(path=str(tmp_path / 'session')))
    path = host.record(plan).result(TIMEOUT_S)
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
