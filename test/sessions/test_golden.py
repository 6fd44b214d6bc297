# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The golden sessions replay: recorded by a node in real time, run again without ROS.

    life            write 2, read, erase, come to rest, read
    manual_drive    write 0, then one level on by strain set by hand, read
    aborted_write   write 3, abort on the way, write 1, read

They were recorded with numpy 2.4 and numba 0.68 on a processor with AVX-512; a build that gives
other bits must still decode the same levels.
"""

import random
import shutil
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from sampled import sampled

from mlmem import Faults, MemoryElement, Refused, SetFaults, SetStrain, Write
from mlmem.physics import CASE_II
from mlmem_ros import __version__
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.session import records
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import build_element, run_replay

pytest_plugins = ['mlmem_ros.testing']

DATA = Path(__file__).parent.parent / 'data'


@pytest.mark.parametrize(
    ('bag', 'levels', 'done'),
    [
        ('life', [2, 2, -1], ['write', 'read', 'erase', 'read']),
        ('manual_drive', [0, 1], ['write', 'read']),
        ('aborted_write', [3, 3], ['write: aborted', 'abort', 'write', 'read']),
    ],
)
def test_golden_session_replays(replay_session, bag, levels, done):
    session = replay_session(DATA / bag)
    session.assert_levels(levels)
    assert session.report.hashes >= 2
    assert session.report.refused == []
    outcomes = [f'{each.procedure}: {each.error}' for each in session.report.outcomes]
    assert [each.removesuffix(': ') for each in outcomes] == done


def test_replay_says_where_and_by_how_much_it_differs():
    """Move the first command by one tick: the bits differ from the next hash on."""
    session = load_session(DATA / 'life')
    tick, command = session.stamped[0]
    session.stamped[0] = (tick + 1, command)
    report = run_replay(session)
    assert not report.exact
    assert report.difference is not None
    assert report.difference.tick == next(h.tick for h in session.hashes if h.tick > tick)
    # One tick later under the same ramp: the wall's cells lag by up to some tenths of a cell.
    assert 1e-9 < report.difference.by < 2.5


# --- recorded here, without a node --------------------------------------------------------------

NODE = '/robot/mlmem'
COMMANDS = {3: SetFaults(Faults(actuator_lag=100.0)), 10: SetStrain(0.004), 40: SetStrain(0.0)}


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Drive a device by hand for a hundred ticks; return the bag."""
    path = tmp_path_factory.mktemp('recorded') / 'bag'
    element = MemoryElement(CASE_II)
    header, command, state_hash = (
        f'{NODE}/{topic}'
        for topic in (records.HEADER_TOPIC, records.COMMAND_TOPIC, records.STATE_HASH_TOPIC)
    )
    with BagWriter(path) as writer:
        for topic in (header, command, state_hash):
            writer.add_topic(topic, records.STRING_TYPE)
        writer.write(header, records.build_header(element, NODE, {'autostart': True}), 0)
        for tick in range(100):
            if tick in COMMANDS:
                element.apply(COMMANDS[tick])
                writer.write(command, records.build_command(tick, COMMANDS[tick]), tick)
            element.advance()
        writer.write(state_hash, records.build_state_hash(element), 100)
    return path


def test_recorded_session_replays_to_the_bit(bag):
    data = load_session(bag)
    report = run_replay(data)
    assert report.exact
    assert (report.hashes, report.refused) == (1, [])
    assert data.node == NODE
    assert data.header.versions['mlmem_ros'] == __version__
    assert data.header.parameters == {'autostart': True}
    assert build_element(data).design == CASE_II


def test_session_during_a_procedure_is_rejected():
    element = MemoryElement(CASE_II)
    element.apply(Write(2))
    element.advance()
    with pytest.raises(Refused):
        records.build_header(element, NODE, {})


def test_session_copied_by_another_tool_replays(bag, tmp_path):
    writing = Writer(tmp_path / 'copy', version=9, storage_plugin=StoragePlugin.MCAP)
    with Reader(bag) as reader, writing as writer:
        copies = {
            each.id: writer.add_connection(
                each.topic, each.msgtype, msgdef=each.msgdef.data, rihs01=each.digest
            )
            for each in reader.connections
        }
        for each, time, cdr in reader.messages():
            writer.write(copies[each.id], time, cdr)
    found = load_session(tmp_path / 'copy')
    assert found.lost == []
    assert run_replay(found).exact


@pytest.mark.parametrize(
    ('name', 'count'),
    sampled(
        [('bag_0.mcap', 50), ('metadata.yaml', 20), ('bag_0.mcap', 2000), ('metadata.yaml', 500)],
        lambda each: each[1] < 100,
    ),
)
def test_session_with_a_flipped_bit_is_not_whole(bag, tmp_path, name, count):
    """The CRCs of the file and its copy of `metadata.yaml` cover every byte."""
    copy = Path(shutil.copytree(bag, tmp_path / 'copy'))
    whole = (copy / name).read_bytes()
    chance = random.Random(1)
    # the end of a file has many lengths and offsets
    ends = range(len(whole) - 40, len(whole), 1 if count >= 500 else 3)
    for place in [*chance.sample(range(len(whole)), count), *ends]:
        flipped = bytearray(whole)
        flipped[place] ^= 1 << chance.randrange(8)
        (copy / name).write_bytes(flipped)
        try:
            found = load_session(copy).lost
        except BagError as error:
            found = [str(error)]
        assert found, f'byte {place} of {len(whole)}'
