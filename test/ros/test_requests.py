# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests that carry their arguments: several clients share an element and mix up nothing."""

import re

import pytest
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter

from mlmem_ros import RequestRefused, standalone


def test_of_two_writes_at_once_one_is_done_whole_and_the_other_changes_nothing(memory, robot):
    """As requests that set a parameter first and pull the trigger then did not."""
    with standalone(memory.element) as one, standalone(memory.element) as other:
        one.ready().wait()
        other.ready().wait()
        replies = {1: one.write(1), 2: other.write(2)}
        written, refused = {}, {}
        for level, reply in replies.items():
            try:
                written[level] = reply.wait()
            except RequestRefused as busy:
                refused[level] = busy
    ((level, content),) = written.items()
    ((other_level, busy),) = refused.items()
    assert busy.answer == {
        'error': 'busy: write is running; abort it or wait', 'asked': other_level,
    }  # fmt: skip
    assert content.level == robot.trigger('read')['level'] == level
    assert robot.get('target_level') == 0


def test_an_answer_names_the_level_that_was_asked_for(robot):
    robot.set(target_level=3)
    assert robot.trigger('write')['asked'] == 3
    refused = robot.answer(robot.ask('write', level=9))
    assert (refused.success, refused['asked']) == (False, 9)


def test_an_end_is_probed_for_this_once(memory, robot):
    with standalone(memory.element) as client:
        assert client.read(end='right').wait().end == 'right'
        assert client.read(end='both').wait().details['walls'] == 1
        assert client.read().wait().end == 'left'
        with pytest.raises(RequestRefused, match="end must be left, right or both; got 'top'"):
            client.read(end='top').wait()
    assert robot.get('read.end') == 'left'


@pytest.mark.parametrize(
    ('name', 'arguments', 'reason'),
    [
        ('wipe', {}, "request must be one of write, read, erase, .*; got 'wipe'"),
        (7, {}, "got ''"),
        ('write', {}, 'write must be given level'),
        ('write', {'level': '5'}, r'level must be of type 2 \(integer\); got type 4'),
        ('write', {'level': True}, 'level must be of type 2'),
        ('write', {'level': 2, 'end': 'left'}, "write must be given level; got 'end'"),
        ('erase', {'level': 2}, "erase must be given nothing else; got 'level'"),
        ('follow', {'times': [1.0]}, 'follow must be given strains'),
    ],
)
def test_a_request_that_is_none_is_refused_in_a_word(robot, name, arguments, reason):
    refused = robot.answer(robot.ask(name, **arguments))
    assert not refused.success
    assert re.search(reason, refused['error'])


def test_no_argument_is_named_twice(robot):
    level = Parameter('level', value=1).to_parameter_msg()
    request = SetParametersAtomically.Request(parameters=[level, level])
    refused = robot.answer(robot.send('request', request))
    assert refused['error'] == 'a request must name every argument once'
    refused = robot.answer(robot.send('request'))
    assert 'request must be one of' in refused['error']
