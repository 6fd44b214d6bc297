# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot keeps its gait only in the memory: through a crash, a slow write, a stuck actuator.

Memory and behaviour run in this process; docs/faults.md explains the tools.
"""

import threading
from contextlib import suppress
from pathlib import Path

import pytest
import rclpy
from gait_store.gait_node import GaitNode
from gait_store.gaits import GAITS
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, UInt8

from mlmem_ros.contract.topics import Qos
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.testing import assert_replays, assert_written, faults, frozen_clock, memory_node

QUICK = {'time.speed': 10.0, 'publish.field_every': 0, 'publish.wall_every': 0}


class Behaviour:
    """The node under test, spun by its own thread."""

    def __init__(self, memory, sim_time=False):
        self._context = Context()
        rclpy.init(context=self._context)
        clock = Parameter('use_sim_time', value=sim_time)
        self.node = GaitNode(
            context=self._context,
            parameter_overrides=[clock, Parameter('memory', value=memory.element)],
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._executor.create_task(self.node.recall_gait)
        self._thread = threading.Thread(target=self._turn, daemon=True)
        self._thread.start()

    def _turn(self):
        with suppress(ExternalShutdownException):
            self._executor.spin()

    def end(self):
        rclpy.try_shutdown(context=self._context)
        self._thread.join()
        self.node.destroy_node()


class Robot:
    """A client that requests gaits and watches the legs."""

    def __init__(self, node):
        self.gaits, self.pressures, self.strains = [], [], []
        self._set_gait = node.create_publisher(UInt8, '/gait/set_gait', Qos.RELIABLE.profile)
        for kind, topic, values, qos in (
            (UInt8, 'gait', self.gaits, Qos.LATCHED.profile),
            (Float32MultiArray, 'pressures', self.pressures, Qos.SENSOR_DATA.profile),
        ):
            keep = lambda message, values=values: values.append(message.data)  # noqa: E731
            node.create_subscription(kind, f'/gait/{topic}', keep, qos)
        strain = lambda message: self.strains.append(message.position[0])  # noqa: E731
        node.create_subscription(
            JointState, '/mlmem/joint_states', strain, Qos.SENSOR_DATA.profile
        )

    def set_gait(self, gait):
        wait_until(self._set_gait.get_subscription_count, 'the behaviour node')
        self._set_gait.publish(UInt8(data=gait))

    def walks(self, gait):
        return self.gaits[-1:] == [gait]

    def wait_for_gait(self, gait):
        wait_until(lambda: self.walks(gait), f'gait {gait}', 30.0)


@pytest.fixture(scope='module')
def memory():
    with memory_node(QUICK) as node:
        yield node


@pytest.fixture(scope='module')
def robot(memory):
    return Robot(memory.memory.node)


@pytest.fixture
def behave(memory, robot):
    """Start the behaviour: behave(); it ends with the test at the latest."""
    running = []

    def start(**options):
        robot.gaits.clear()
        running.append(Behaviour(memory, **options))
        return running[-1]

    yield start
    for behaviour in running:
        behaviour.end()


def test_a_gait_is_a_level():
    assert len(GAITS) == 8
    for gait in GAITS:
        pressures = [gait.compute_pressures(tick / 100) for tick in range(500)]
        assert all(0.0 <= p <= 1.0 for legs in pressures for p in legs)
        assert max(max(legs) for legs in pressures) > 0.9 or gait.name == 'rest'


def test_a_recorded_day_replays():
    """A recorded day: blank at first; written, read after a restart; another one, read again."""
    assert_replays(Path(__file__).parents[1] / 'bag').assert_levels([-1, 1, 1, 3, 3])


def test_a_behaviour_walks_on_after_a_crash(memory, robot, behave, tmp_path):
    bag = tmp_path / 'session'
    memory.memory.record(path=str(bag)).wait()
    first = behave()
    robot.wait_for_gait(0)
    robot.set_gait(8)  # there is no such gait: nothing changes
    robot.set_gait(1)
    robot.wait_for_gait(1)
    assert robot.gaits == [0, 1]
    wait_until(lambda: robot.pressures and max(robot.pressures[-1]) > 0.0, 'legs that move')
    first.end()
    behave()
    robot.wait_for_gait(1)
    assert robot.gaits == [1]  # it did not rest in between
    memory.memory.record(False).wait()
    assert_written(bag, 1)


def test_the_legs_keep_the_old_gait_until_the_new_one_is_written(memory, robot, behave):
    memory.memory.write(1).wait()
    behave(sim_time=True)
    robot.wait_for_gait(1)
    with frozen_clock(memory) as clock:
        robot.strains.clear()
        robot.set_gait(3)
        clock.advance_until(lambda: any(robot.strains))  # the write has begun
        robot.pressures.clear()
        clock.advance(0.06)  # three periods of the legs, and a quarter of the write
        assert robot.walks(1)
        wait_until(lambda: robot.pressures, 'legs that move')
        clock.advance_until(lambda: robot.walks(3))
    assert memory.memory.read().wait().level == 3


def test_a_write_that_fails_changes_no_gait(memory, robot, behave):
    memory.memory.write(1).wait()
    behave()
    robot.wait_for_gait(1)
    with faults(memory, actuator_stuck=True):
        failed = memory.output.count('write failed')
        robot.set_gait(2)
        wait_until(lambda: memory.output.count('write failed') > failed, 'a write that fails')
        assert robot.gaits == [1]
    robot.set_gait(2)
    robot.wait_for_gait(2)
