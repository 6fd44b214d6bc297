# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A session recorded without a node replays to the bit."""

import json
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
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.session import records
from mlmem_ros.session.data import load_session
from mlmem_ros.session.records import SessionTopic
from mlmem_ros.session.replay import build_element, run_replay

NODE = '/robot/mlmem'
COMMANDS = {3: SetFaults(Faults(actuator_lag=100.0)), 10: SetStrain(0.004), 40: SetStrain(0.0)}


@pytest.fixture
def recorded(tmp_path):
    """Drive a device by hand for a hundred ticks; return its bag and what was recorded."""
    element = MemoryElement(CASE_II)
    header, command, state_hash, _ = topics = [f'{NODE}/{topic}' for topic in SessionTopic]
    with BagWriter(tmp_path / 'bag') as writer:
        for name, topic in zip(topics, SessionTopic, strict=True):
            writer.add_topic(name, topic.type)
        writer.write(header, records.build_header(element, NODE, {'autostart': True}), 0)
        for tick in range(100):
            if tick in COMMANDS:
                element.apply(COMMANDS[tick])
                writer.write(command, records.build_command(tick, COMMANDS[tick]), tick)
            element.advance()
        writer.write(state_hash, records.build_state_hash(element), 100)
    return load_session(tmp_path / 'bag'), element


def test_header_has_initial_state_and_versions(recorded, tmp_path):
    data, _ = recorded
    assert data.node == NODE
    assert data.header.versions['mlmem_ros'] == __version__
    bag = BagReader(tmp_path / 'bag')
    (message,) = bag.messages([f'{NODE}/session'])
    values = json.loads(bag.deserialize(message).data)
    assert values['format'] == records.SESSION_FORMAT
    assert values['parameters'] == {'autostart': True}
    assert build_element(data).design == CASE_II


def test_session_during_a_procedure_is_rejected():
    element = MemoryElement(CASE_II)
    element.apply(Write(2))
    element.advance()
    with pytest.raises(Refused):
        records.build_header(element, NODE, {})


def test_session_copied_by_another_tool_replays(recorded, tmp_path):
    writing = Writer(tmp_path / 'copy', version=9, storage_plugin=StoragePlugin.MCAP)
    with Reader(tmp_path / 'bag') as reader, writing as writer:
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


@pytest.mark.parametrize('count', sampled([50, 2000], lambda count: count < 100))
def test_session_with_a_flipped_bit_is_not_whole(recorded, tmp_path, count):
    """The CRCs of the file cover every byte."""
    copy = Path(shutil.copytree(tmp_path / 'bag', tmp_path / 'copy'))
    file = copy / 'bag_0.mcap'
    whole = file.read_bytes()
    chance = random.Random(1)
    # the end of a file has many lengths and offsets
    ends = range(len(whole) - 40, len(whole), 1 if count >= 500 else 3)
    for place in [*chance.sample(range(len(whole)), count), *ends]:
        flipped = bytearray(whole)
        flipped[place] ^= 1 << chance.randrange(8)
        file.write_bytes(flipped)
        try:
            found = load_session(copy).lost
        except BagError as error:
            found = [str(error)]
        assert found, f'byte {place} of {len(whole)}'
