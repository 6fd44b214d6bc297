# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the log and the graph tell without being asked."""

import re

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from robot import OUT, RELIABLE, Robot

from mlmem_ros.host.design_check import Verdict
from mlmem_tools.cli.checkup import check_node


def test_a_default_subscriber_receives_every_stream(robot):
    """`create_subscription(..., 10)` is reliable and does not match best-effort publishers."""
    for topic in ('joint_states', 'field', 'wall', 'range'):
        heard = []
        kind, _ = OUT[topic]
        robot.node.create_subscription(kind, robot.name(topic), heard.append, RELIABLE)
        if topic == 'range':
            assert robot.trigger('read')
        robot.wait(lambda heard=heard: heard, topic)


def test_the_messages_of_an_element_at_rest_have_stamps_of_their_own(robot):
    heard = [robot.next('joint_states', lambda state: state.velocity[1] == 0.0) for _ in range(3)]
    assert len({str(state.header.stamp) for state in heard}) == len(heard)


def test_how_a_procedure_ended_is_in_the_log(memory, robot):
    assert robot.write(0).success
    robot.wait(lambda: 'write succeeded after' in memory.output, 'a line in the log')
    assert ': level 0' in memory.output


def test_transitions_changed_parameters_and_refusals_are_in_the_log(start):
    node = start(name='told')
    with Robot('/told', 'told_robot') as robot:
        robot.set(time__speed=2.0, faults__seed=3)
        assert not robot.try_set('element', 'bits_1').successful
        assert not robot.answer(robot.ask('write', level=9)).success
        assert not robot.answer(robot.ask('write')).success
        assert not robot.trigger('step').success
        transitions = (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP)
        for transition in transitions:
            request = ChangeState.Request(transition=Transition(id=transition))
            assert robot.response(robot.send('change_state', request, ChangeState)).success
        assert not robot.trigger('read').success
    others = re.compile('preparing|ready|.* ticks of time were skipped')  # on a loaded machine
    lines = [line.partition(' [told]: ')[::2] for line in node.output.splitlines()]
    assert [line for line in lines if not others.match(line[1])] == [
        ('[INFO]', 'active: time runs'),
        ('[INFO]', 'set time.speed = 2.0'),
        ('[INFO]', 'set faults.seed = 3'),
        ('[WARN]', 'a parameter refused: element may be set only while the node is unconfigured'),
        ('[WARN]', 'write refused: level must be a whole number from 0 to 7; got 9'),
        (
            '[WARN]',
            'request refused: write must be given level (of one wall) or word (of a register)',
        ),
        ('[WARN]', 'step refused: step works only while paused; pause first'),
        ('[INFO]', 'inactive: the strain is zero, time stands still'),
        ('[INFO]', 'unconfigured: the device is released'),
        ('[WARN]', 'read refused: inactive: configure and activate the node first'),
    ]


def test_a_missing_clock_is_reported(start):
    node = start({'use_sim_time': True}, name='frozen')
    with Robot('/frozen', 'frozen_robot') as robot:
        robot.wait(lambda: 'no /clock has arrived yet' in node.output, 'the warning')
        found = check_node('/frozen', 10.0)
        assert (found.verdict, found.seen[-28:]) == (Verdict.WARN, '/clock that nobody publishes')
        robot.next('/diagnostics', lambda array: array.status[0].hardware_id == '/frozen')


def test_two_nodes_may_not_share_a_state_file(start, refused, tmp_path):
    shared = {'state.path': str(tmp_path / 'element.json')}
    start(shared, name='first')
    with Robot('/first', 'first_robot') as robot:
        assert robot.write(1).success
    (tmp_path / 'elsewhere').mkdir()
    link = tmp_path / 'elsewhere' / 'link.json'
    link.symlink_to(tmp_path / 'element.json')
    for path in (shared['state.path'], str(link)):
        line = refused({**shared, 'state.path': path}, name='second', warned=True)
        assert 'element.json is in use by /first (process' in line
    assert link.is_symlink()


def test_the_level_is_the_content_and_not_an_echo_during_a_write(start):
    """A kink on its way is listened to: other levels, and none while there are two walls."""
    start(name='slow')
    with Robot('/slow', 'slow_robot') as robot:
        assert robot.write(2).success
        levels = robot.received('level')
        robot.wait(lambda: levels and levels[-1].data == 2, 'the level that was written')
        heard, outcomes = len(robot.received('echo')), len(robot.received('outcome'))
        before = len(levels)
        assert robot.write(1).success
        robot.wait(lambda: len(robot.received('outcome')) > outcomes, 'the outcome')
        robot.wait(lambda: levels[-1].data == 1, 'the level')
        assert len(robot.received('echo')) > heard + 1
        assert [level.data for level in levels[before:]] == [1]
