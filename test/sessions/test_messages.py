# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A session recorded without a node replays to the bit."""

import json

import pytest

from mlmem_ros import __version__
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.device import Faults, Refused, SetFaults, SetStrain, Write, new_element
from mlmem_ros.physics import CASE_II
from mlmem_ros.session import records
from mlmem_ros.session.data import load
from mlmem_ros.session.replay import element_of, replay

NODE = '/robot/mlmem'
COMMANDS = {3: SetFaults(Faults(actuator_lag=100.0)), 10: SetStrain(0.004), 40: SetStrain(0.0)}


@pytest.fixture
def recorded(tmp_path):
    """Drive a device by hand for a hundred ticks; return its bag and what was recorded."""
    element = new_element(CASE_II)
    header, command, state_hash = (
        f'{NODE}/{topic}' for topic in (records.HEADER, records.COMMAND, records.STATE_HASH)
    )
    with BagWriter(tmp_path / 'bag') as writer:
        for topic in (header, command, state_hash):
            writer.add_topic(topic, records.STRING)
        writer.write(header, records.header(element, NODE, {'autostart': True}), 0)
        for tick in range(100):
            if tick in COMMANDS:
                element.apply(COMMANDS[tick])
                writer.write(command, records.command(tick, COMMANDS[tick]), tick)
            element.advance()
        writer.write(state_hash, records.state_hash(element), 100)
    return load(tmp_path / 'bag'), element


def test_it_replays_to_the_bit(recorded):
    data, _ = recorded
    report = replay(data)
    assert report.exact
    assert report.hashes == 1
    assert report.refused == []


def test_the_commands_are_those_that_were_given(recorded):
    data, _ = recorded
    assert dict(data.stamped) == COMMANDS


def test_the_hash_holds_the_displacements_to_the_bit(recorded):
    data, element = recorded
    (last,) = data.hashes
    assert last.tick == 100
    assert last.v.tolist() == element.chain.v.tolist()


def test_the_header_has_the_initial_state_and_versions(recorded, tmp_path):
    data, _ = recorded
    assert data.node == NODE
    assert data.header.versions['mlmem_ros'] == __version__
    bag = BagReader(tmp_path / 'bag')
    (message,) = bag.messages([f'{NODE}/session'])
    values = json.loads(bag.deserialize(message).data)
    assert values['format'] == records.FORMAT
    assert values['parameters'] == {'autostart': True}
    assert element_of(data).design == CASE_II


def test_no_session_begins_in_the_middle_of_a_procedure():
    element = new_element(CASE_II)
    element.apply(Write(2))
    element.advance()
    with pytest.raises(Refused):
        records.header(element, NODE, {})
