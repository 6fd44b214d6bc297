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
    kinds = [(kind, text.partition(':')[0]) for kind, text in lines if not others.match(text)]
    assert kinds == [
        ('[INFO]', 'active'),
        ('[INFO]', 'set time.speed = 2.0'),
        ('[INFO]', 'set faults.seed = 3'),
        ('[WARN]', 'a parameter refused'),
        ('[WARN]', 'write refused'),
        ('[WARN]', 'request refused'),
        ('[WARN]', 'step refused'),
        ('[INFO]', 'inactive'),
        ('[INFO]', 'unconfigured'),
        ('[WARN]', 'read refused'),
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
