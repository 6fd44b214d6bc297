# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever is changed in a session is noticed, also where a replay computes nothing.

A tool that writes the bag again makes its checksums right; the digests among the messages are not.
A flipped bit leaves the digests right; the checksums are not.
"""

import random
import shutil
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from sampled import sampled

from mlmem_ros.bag import digest, jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.device import SetStrain, new_element, preset
from mlmem_ros.session import records
from mlmem_ros.session.data import load
from mlmem_ros.session.replay import replay

from .tampering import Tampered

NODE = '/mlmem'
OWN = {name: f'{NODE}/{name}' for name in (records.HEADER, records.COMMAND, records.STATE_HASH)}
HEARD = '/heard'
"""A topic that no replay computes."""


def record(path, closed=True):
    """Drive a device by hand for 60 ticks, and record it with a sync every 20."""
    element = new_element(preset('bits_1'))
    writer = BagWriter(path, digests=f'{NODE}/{records.DIGEST}')
    for topic in OWN.values():
        writer.add_topic(topic, records.STRING)
    writer.add_topic(HEARD, 'std_msgs/msg/Float64')
    writer.write(OWN[records.HEADER], records.header(element, NODE, {}), 0)
    for tick in range(60):
        if tick == 5:
            element.apply(SetStrain(0.001))
            writer.write(OWN[records.COMMAND], records.command(tick, SetStrain(0.001)), tick)
        element.advance()
        heard = jazzy.message('std_msgs/msg/Float64', data=tick / 7)
        writer.write(HEARD, jazzy.serialize(heard), tick + 1)
        if element.ticks % 20 == 0:
            writer.write(OWN[records.STATE_HASH], records.state_hash(element), tick + 1)
            writer.sync()
    if closed:
        writer.close()
    return path


@pytest.fixture(scope='module')
def session(tmp_path_factory):
    return record(tmp_path_factory.mktemp('whole') / 'bag')


def noticed(path):
    """Return what a reader says of a bag: nothing if all is as it was recorded."""
    try:
        found = load(path)
    except BagError as error:
        return str(error)
    return '; '.join([*found.lost, *found.altered])


def changed(session, path, change):
    """Write a session again as a tool would, with its messages changed."""
    made = Tampered.read(session)
    change(made.messages)
    made.write(path)
    return load(path)


def places(topic, found):
    return [place for place, message in enumerate(found) if message.topic == topic]


def test_a_whole_session_agrees_with_its_digests(session, tmp_path):
    found = load(session)
    assert (found.lost, found.altered) == ([], [])
    assert replay(found).exact
    again = changed(session, tmp_path / 'again', lambda messages: None)  # as `ros2 bag convert`
    assert (again.lost, again.altered) == ([], [])


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_copy_by_another_tool_is_still_the_session(session, tmp_path, storage):
    writing = Writer(tmp_path / 'bag', version=9, storage_plugin=storage)
    with Reader(session) as reader, writing as writer:
        copies = {
            each.id: writer.add_connection(
                each.topic, each.msgtype, msgdef=each.msgdef.data, rihs01=each.digest
            )
            for each in reader.connections
        }
        for each, time, cdr in reader.messages():
            writer.write(copies[each.id], time, cdr)
    found = load(tmp_path / 'bag')
    assert (found.lost, found.altered) == ([], [])
    assert replay(found).exact


def test_any_tampering_with_a_message_is_noticed(session, tmp_path):
    base = Tampered.read(session)
    unseen = []
    for number in range(40):
        made = base.tamper(number)
        if made.custom or (made.messages, made.topics) == (base.messages, base.topics):
            continue
        made.write(tmp_path / f'{number}')
        if not noticed(tmp_path / f'{number}'):
            unseen.append(made.what)
    assert unseen == []


@pytest.mark.parametrize(
    ('name', 'count'),
    sampled(
        [('bag_0.mcap', 50), ('metadata.yaml', 20), ('bag_0.mcap', 2000), ('metadata.yaml', 500)],
        lambda each: each[1] < 100,
    ),
)
def test_any_flipped_bit_of_a_file_is_noticed(session, tmp_path, name, count):
    copy = Path(shutil.copytree(session, tmp_path / 'bag'))
    whole = (copy / name).read_bytes()
    chance = random.Random(1)
    # the end of a file has many lengths and offsets
    ends = range(len(whole) - 40, len(whole), 1 if count >= 500 else 3)
    for place in [*chance.sample(range(len(whole)), count), *ends]:
        flipped = bytearray(whole)
        flipped[place] ^= 1 << chance.randrange(8)
        (copy / name).write_bytes(flipped)
        assert noticed(copy), f'byte {place} of {len(whole)}'


def test_messages_in_another_order_are_not_those_that_were_recorded(session, tmp_path):
    def swap(found):
        one, other = places(HEARD, found)[3:5]
        found[one], found[other] = found[other], found[one]

    (told,) = changed(session, tmp_path / 'bag', swap).altered
    assert told == 'the 23 messages before digest 0'


def test_a_message_more_is_not_of_the_recording(session, tmp_path):
    found = changed(session, tmp_path / 'bag', lambda found: found.insert(3, found[3]))
    assert found.altered == ['the 23 messages before digest 0']
    report = replay(found)
    assert report.equal_hashes == report.hashes == 3  # nothing that is computed has changed
    assert not report.passed
    assert report.verdict.startswith('ALTERED since it was recorded: the 23 messages')
    after = changed(session, tmp_path / 'after', lambda found: found.append(found[3]))
    assert after.altered == ['messages follow the digest that ended the recording']


@pytest.mark.parametrize(
    ('left_out', 'lost'),
    [
        (lambda found: found.__delitem__(3), '1 of 23 messages before digest 0'),
        (lambda found: found.__delitem__(slice(24, 46)), 'digests 1 to 1 and what they cover'),
        (lambda found: found.__delitem__(slice(-23, None)), 'the digest that ends the recording'),
    ],
)
def test_what_was_left_out_is_missing(session, tmp_path, left_out, lost):
    found = changed(session, tmp_path / 'bag', left_out)
    assert (found.lost, found.altered) == ([lost], [])


def test_a_killed_recorder_leaves_what_agrees(tmp_path):
    found = load(record(tmp_path / 'bag', closed=False))
    assert ['was not closed' in line for line in found.lost] == [True]
    assert found.altered == []


def test_a_session_without_its_digests_is_not_whole(session, tmp_path):
    def strip(found):
        found[:] = [message for message in found if not message.topic.endswith(records.DIGEST)]

    assert changed(session, tmp_path / 'bag', strip).lost == ['the digest that ends the recording']


def test_a_digest_of_nothing_covers_what_follows():
    running = digest.Running()
    first = running.digest()
    running.go_on(first)
    assert (first.number, running.digest().number) == (0, 1)
    assert running.digest().sha256 != first.sha256
    assert running.digest(closed=True).sha256 != running.digest().sha256
