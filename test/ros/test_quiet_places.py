# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the log and the graph tell without being asked."""

import re

from robot import Robot


def test_messages_of_an_idle_element_have_own_stamps(robot):
    heard = [robot.next('joint_states', lambda state: state.velocity[1] == 0.0) for _ in range(3)]
    assert len({str(state.header.stamp) for state in heard}) == len(heard)


def test_log_lists_transitions_settings_and_rejections(start):
    node = start(name='told')
    with Robot('/told', 'told_robot') as robot:
        robot.set(time__speed=2.0, faults__seed=3)
        assert not robot.try_set('element', 'bits_1').successful
        assert not robot.answer(robot.ask('write', level=9)).success
        assert not robot.answer(robot.ask('write')).success
        assert not robot.trigger('step').success
        robot.change_state('deactivate', 'cleanup')
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


def test_level_topic_ignores_echoes_during_a_write(start):
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
