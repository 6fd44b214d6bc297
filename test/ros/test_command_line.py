# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The plain options of the executable, their ROS arguments, and the speed of time."""

import pytest
from nodes import end_node
from robot import Robot, values

from mlmem_ros import __version__
from mlmem_ros.ros.main import parse_node_arguments
from mlmem_tools.cli.main import main as mlmem

ROS = ['--ros-args', '--log-level', 'warn', '-p', 'time.speed:=7.0', '-r', '__node:=other']


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        (['--speed', 'max', *ROS], [*ROS, '--ros-args', '-p', 'time.speed:=0.0']),
        (['--speed=2.5', *ROS], [*ROS, '--ros-args', '-p', 'time.speed:=2.5']),
        ([*ROS, '--', '--speed', '2'], [*ROS, '--', '--ros-args', '-p', 'time.speed:=2.0']),
        (['--view'], ['--ros-args', '-p', 'view:=true']),
        ([*ROS, '--'], [*ROS, '--']),
        ([], []),
    ],
)
def test_plain_option_becomes_a_parameter(given, expected):
    """The parameter stands last, so that it overrides one that is given."""
    assert parse_node_arguments(['node', *given]) == ['node', *expected]


@pytest.mark.parametrize(
    ('given', 'word'),
    [
        (['--bogus'], '--bogus'),
        (['bogus'], 'bogus'),
        (['--spee', '2'], '--spee'),
        (['--bogus', '--ros-args', '--', '--speed', '2'], '--bogus'),
        *[([f'--speed={factor}'], factor) for factor in ('nan', 'inf', '-1', '0', '1e7', 'fast')],
    ],
    ids=str,
)
def test_unknown_option_or_bad_speed_is_rejected(given, word, capsys):
    with pytest.raises(SystemExit) as refused:
        parse_node_arguments(['node', *given])
    assert refused.value.code == 2
    assert word in capsys.readouterr().err


@pytest.mark.parametrize('of', [mlmem, lambda given: parse_node_arguments(['node', *given])])
def test_version_is_printed(of, capsys):
    with pytest.raises(SystemExit) as told:
        of(['--version'])
    assert told.value.code == 0
    assert capsys.readouterr().out == f'mlmem_ros {__version__}\n'


def test_speed_max_runs_faster_than_real_time(start):
    """The factor in the diagnostics is ticks a second times 2 ms."""
    node = start({'scale.time': 1e-4}, options=['--speed', 'max'])
    with Robot() as robot:
        robot.next('/diagnostics')  # the first may include the start
        loop = robot.next_status('loop')
        assert robot.get('time.speed') == 0.0
        assert robot.write(0).success  # requests also end a rest without a pace
        assert robot.trigger('read')['level'] == 0
    told = {key: float(values(loop)[key]) for key in ('rate', 'real_time_factor')}
    assert told['real_time_factor'] == pytest.approx(0.002 * told['rate'], rel=1e-4)
    assert told['real_time_factor'] > 1.5  # 20 on an idle machine
    end_node(node)
