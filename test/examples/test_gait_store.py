# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The gait store keeps its gait in the memory alone: replayed from its bag, and live."""

import subprocess
import sys
from pathlib import Path

import pytest
from std_msgs.msg import Float32MultiArray, UInt8

from mlmem_ros import standalone
from mlmem_ros.ros.client.standalone import wait_until
from mlmem_ros.ros.qos import LATCHED, RELIABLE, SENSOR_DATA

pytest_plugins = ['mlmem_ros.testing']

QUICK = {'scale.time': 2e-5, 'publish.field_every': 0, 'publish.wall_every': 0}
EXAMPLE = Path(__file__).parent.parent.parent / 'examples' / 'gait_store'


def test_the_gait_is_remembered(replay_session):
    """Blank at first; written, read after a restart; another one written, read again."""
    replay_session(EXAMPLE / 'bag').assert_levels([-1, 1, 1, 3, 3])


def test_a_gait_is_a_level(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLE)
    from gaits import GAITS

    assert len(GAITS) == 8
    for gait in GAITS:
        pressures = [gait.pressures(tick / 100) for tick in range(500)]
        assert all(0.0 <= p <= 1.0 for legs in pressures for p in legs)
        assert max(max(legs) for legs in pressures) > 0.9 or gait.name == 'rest'


class Robot:
    """One who asks for gaits and looks at the legs."""

    def __init__(self, memory):
        self.gaits, self.pressures = [], []
        self._node = memory.node
        self._set_gait = memory.node.create_publisher(UInt8, '/gait/set_gait', RELIABLE)
        for kind, topic, values, qos in (
            (UInt8, 'gait', self.gaits, LATCHED),
            (Float32MultiArray, 'pressures', self.pressures, SENSOR_DATA),
        ):
            keep = lambda message, values=values: values.append(message.data)  # noqa: E731
            memory.node.create_subscription(kind, f'/gait/{topic}', keep, qos)

    def set_gait(self, gait):
        wait_until(self._set_gait.get_subscription_count, 'the behaviour node')
        self._set_gait.publish(UInt8(data=gait))

    def wait_for_gait(self, gait):
        wait_until(lambda: self.gaits[-1:] == [gait], f'gait {gait}', 30.0)


@pytest.fixture
def behave():
    """Start behaviour nodes; those that are left are killed."""
    processes = []

    def start():
        processes.append(subprocess.Popen([sys.executable, EXAMPLE / 'gait_node.py']))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.wait()


def test_a_killed_behaviour_walks_on(start, behave):
    start(QUICK)
    with standalone() as memory:
        robot = Robot(memory)
        memory.ready(60).wait()
        first = behave()
        robot.wait_for_gait(0)
        robot.set_gait(8)  # there is none: nothing changes
        robot.set_gait(1)
        robot.wait_for_gait(1)
        assert robot.gaits == [0, 1]
        wait_until(lambda: robot.pressures and max(robot.pressures[-1]) > 0.0, 'legs that move')
        first.kill()
        first.wait()
        robot.gaits.clear()
        behave()
        robot.wait_for_gait(1)
        assert robot.gaits == [1]  # it did not rest in between
        assert memory.read().wait().level == 1
