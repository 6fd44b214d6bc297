# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The last seconds before a request or a failure are in the session and replay to the bit."""

import math

import pytest

from mlmem_ros.bag.errors import BagError
from mlmem_ros.device import Read, SetStrain, Write
from mlmem_ros.host import last_seconds
from mlmem_ros.host.settings import RecordSettings
from mlmem_ros.session.data import load
from mlmem_ros.session.replay import replay

SOON = 30.0
LONG = RecordSettings(last_seconds=3600.0)
SHORT = RecordSettings(last_seconds=1.0, hash_every=50)
"""A write takes longer: 1 s are 1000 ticks."""


def recorded(service, path):
    """Record for a moment; return the session."""
    host = service.host
    bag = host.record(service.plan(RecordSettings(path=str(path)))).result(SOON)
    host.record(None).result(SOON)
    return load(bag)


def begun(session):
    """Return the tick with which a session begins."""
    return session.header.initial['ticks']


def commands(session):
    return [command for _, command in session.stamped]


def test_nothing_is_kept_by_default(serve):
    assert serve().activate().transcript is None


def test_a_session_begins_with_the_last_seconds(serve, tmp_path):
    service = serve(record=LONG)
    host = service.activate()
    assert host.submit(Write(5)).answer.result(SOON).success
    reading = host.submit(Read()).answer  # a session may begin while a procedure runs
    path = host.record(service.plan(RecordSettings(path=str(tmp_path / 'session')))).result(SOON)
    assert reading.result(SOON).reading.level == 5
    assert host.record(None).result(SOON) == path
    session = load(path)
    assert begun(session) == 0
    assert commands(session) == [Write(5), Read()]
    report = replay(session)
    assert report.exact
    assert [outcome.reading.level for outcome in report.outcomes] == [5, 5]


def test_the_last_seconds_before_a_failure_are_saved(serve, tmp_path, monkeypatch, log):
    monkeypatch.chdir(tmp_path)
    service = serve(record=LONG)
    host = service.activate()
    assert host.submit(Write(2)).answer.result(SOON).success
    assert host.submit(SetStrain(0.01)).answer.result(SOON) is None
    host.loop.call(lambda: host.element.chain.v.__setitem__(100, math.nan)).result(SOON)
    assert service.failed.wait(SOON)
    host.fail()
    (bag,) = tmp_path.glob('session-*')
    assert any(str(bag) in line for line in log.of('info'))
    session = load(bag)
    assert commands(session) == [Write(2), SetStrain(0.01)]
    report = replay(session)
    assert report.exact
    assert report.outcomes[0].reading.level == 2
    assert host.transcript is None


def test_old_seconds_are_dropped_but_a_long_write_is_kept_whole(serve, tmp_path):
    service = serve(record=SHORT)
    host = service.activate()
    for level in (1, 6):
        assert host.submit(Write(level)).answer.result(SOON).success
    session = recorded(service, tmp_path / 'written')
    (outcome,) = replay(session).outcomes
    assert outcome.reading.level == 6
    assert 0 <= outcome.start_tick - begun(session) <= 1250 + 250
    idle = max(each.tick for each in session.hashes) + 3000
    while host.element.ticks < idle:
        host.loop.call(lambda: None).result(SOON)
    assert 1.0 <= host.sessions.last.kept['last_seconds'] <= 1.6
    session = recorded(service, tmp_path / 'idle')
    assert session.stamped == []
    assert begun(session) >= idle - 1600
    assert replay(session).exact


def test_it_starts_over_after_a_session(serve, tmp_path):
    service = serve(record=LONG)
    host = service.activate()
    assert host.submit(Write(3)).answer.result(SOON).success
    first = recorded(service, tmp_path / 'first')
    assert host.submit(Read()).answer.result(SOON).success
    second = recorded(service, tmp_path / 'second')
    assert begun(second) >= max(each.tick for each in first.hashes)
    assert commands(second) == [Read()]
    assert replay(second).exact


def test_a_session_that_cannot_be_written_loses_nothing(serve, tmp_path):
    service = serve(record=LONG)
    host = service.activate()
    assert host.submit(Write(4)).answer.result(SOON).success
    (tmp_path / 'file').touch()
    with pytest.raises(BagError):
        recorded(service, tmp_path / 'file' / 'session')
    session = recorded(service, tmp_path / 'session')
    assert commands(session) == [Write(4)]
    assert replay(session).exact


def test_the_memory_of_the_last_seconds_is_limited(serve, tmp_path, monkeypatch):
    """A write fills more than the limit: what is kept begins after it."""
    monkeypatch.setattr(last_seconds, 'MOST_BYTES', 50_000)
    service = serve(record=RecordSettings(last_seconds=3600.0, hash_every=50))
    host = service.activate()
    ended = host.submit(Write(1)).answer.result(SOON).end_tick
    assert host.submit(Read()).answer.result(SOON).success
    host.pause(True).result(SOON)
    assert host.sessions.last.kept['last_bytes'] <= 50_000
    session = recorded(service, tmp_path / 'session')
    assert begun(session) >= ended
    assert replay(session).exact
