# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every file of a split recording begins with the state of an idle device, and replays alone."""

from collections import Counter

import pytest
from timeouts import TIMEOUT_S

from mlmem import Read, Write
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.host.recording import BagRecording
from mlmem_ros.host.settings import RecordSettings
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay


def record_until_split(service, path):
    """Write and read until a recording has two full files; return the closed bag."""
    host = service.host
    settings = RecordSettings(str(path), sync_interval=0.02, max_bytes=10_000, hash_every=20)
    bag = host.record(service.plan(settings)).result(TIMEOUT_S)
    for number in range(200):
        if host.sessions.current.full_files >= 2:
            break
        assert host.submit(Write(3 * number % 8)).answer.result(TIMEOUT_S).success
        assert host.submit(Read()).answer.result(TIMEOUT_S).success
    assert host.record(None).result(TIMEOUT_S) == bag
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


def test_file_grows_while_a_procedure_runs(serve, tmp_path):
    """A file of the least size is full within a write, and the next begins after it."""
    service = serve()
    host = service.activate()
    settings = RecordSettings(
        path=str(tmp_path / 'session'), hash_every=5, sync_interval=0.0, max_bytes=1024
    )
    bag = host.record(service.plan(settings)).result(TIMEOUT_S)
    outcome = host.submit(Write(3)).answer.result(TIMEOUT_S)
    host.record(None).result(TIMEOUT_S)
    begun = [load_session(file).header.initial['ticks'] for file in bag.glob('*.mcap')]
    assert not [tick for tick in begun if outcome.start_tick < tick < outcome.end_tick]


def test_no_file_begins_while_the_disk_is_too_slow(serve, tmp_path, monkeypatch):
    """The state of the device, which takes milliseconds, is not taken for a queue that is full."""
    service = serve()
    host = service.activate()
    monkeypatch.setattr(BagRecording, 'has_margin', False)
    settings = RecordSettings(path=str(tmp_path / 'session'), sync_interval=0.0, max_bytes=1024)
    bag = host.record(service.plan(settings)).result(TIMEOUT_S)
    for level in (3, 5):
        assert host.submit(Write(level)).answer.result(TIMEOUT_S).success
    host.record(None).result(TIMEOUT_S)
    assert len(list(bag.glob('*.mcap'))) == 1
    assert run_replay(load_session(bag)).exact
