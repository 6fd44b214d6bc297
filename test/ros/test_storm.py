# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A storm of random messages and calls over real DDS: every call is answered, the node goes on.

The seed decides what is sent. The lives in test/lives try far more, without ROS; here
middleware, rclpy and process are real.
"""

import math
import random
import signal

import pytest
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from robot import SERVICES, Robot
from sampled import sampled
from sensor_msgs.msg import Imu
from std_srvs.srv import SetBool
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from mlmem_ros.ros.node.run import ENDED, NOT_SAVED

NUMBERS = (0.0, -0.0, 1e-9, 0.01, -0.03, 0.08, 1.0, -1e9, 1e308, 5e-324, math.nan, math.inf)
PATHS = ('', '{folder}/session', '/', '.', '~nosuchuser/x', 'x' * 300, '{folder}/no/such/way')
REQUESTS = ('write', 'read', 'erase', 'abort', 'follow')
KEPT = {'linger', 'files.root', 'autostart', 'view', 'use_sim_time', 'state.path', 'element'}
"""Parameters that the storm leaves alone: the first would keep the node from ending while the
storm is there, the last slow it down a thousandfold."""


class Storm:
    """A client that does random things and keeps all its requests."""

    def __init__(self, robot, folder, seed):
        self.robot = robot
        self.chance = random.Random(seed)
        self.folder = folder
        self.requests = {}
        self.names = sorted(set(robot.parameters()) - KEPT)

    def number(self):
        return self.chance.choice(NUMBERS)

    def act(self):
        self.chance.choice(
            (self.service, self.service, self.topic, self.topic, self.parameter, self.transition)
        )()

    def send(self, what, *request):
        self.requests[self.robot.send(what, *request)] = what

    def __str__(self):
        return f'an answer of every one (without: {self.waiting})'

    def calm(self):
        """Let time run, which waiting requests need, until few requests wait."""
        self.robot.pause(False)
        self.robot.wait(lambda: len(self.waiting) < 8, self)

    @property
    def waiting(self):
        return [what for request, what in self.requests.items() if not request.done()]

    def service(self):
        name = self.chance.choice(sorted(set(SERVICES) - {'calibrate', 'self_test'}))
        kind = SERVICES[name]
        if kind is SetBool:
            on = self.chance.random() < (0.2 if name == 'pause' else 0.5)
            self.send(name, SetBool.Request(data=on))
        elif name == 'request':
            self.send(name, SetParametersAtomically.Request(parameters=self.arguments()))
        else:
            self.send(name)

    def arguments(self):
        """Return the arguments of a request, right or wrong."""
        asked = ParameterValue(type=4, string_value=self.chance.choice((*REQUESTS, '', 'wipe')))
        given = [Parameter(name='request', value=asked)]
        names = ('level', 'end', 'times', 'strains', 'rates', 'request')
        for name in self.chance.sample(names, self.chance.randrange(4)):
            value = ParameterValue(
                type=self.chance.choice((0, 2, 4, 8, 8, 200)),
                integer_value=self.chance.choice((0, 3, -5, 2**62)),
                string_value=self.chance.choice(('left', 'both', '', 'x' * 300)),
                double_array_value=[self.number() for _ in range(self.chance.randrange(4))],
            )
            given.append(Parameter(name=name, value=value))
        return given

    def topic(self):
        topic = self.chance.choice(('strain', 'trajectory', 'probe', 'write_level', 'disturbance'))
        if topic == 'strain':
            self.robot.publish(topic, self.number())
        elif topic == 'write_level':
            self.robot.publish(topic, self.chance.randrange(256))
        elif topic == 'probe':
            self.robot.publish(topic)
        elif topic == 'disturbance':
            message = Imu()
            message.linear_acceleration.x = self.number()
            self.robot.send_message(topic, message)
        else:
            message = JointTrajectory(joint_names=['substrate'] * self.chance.choice((0, 1, 1, 2)))
            for _ in range(self.chance.randrange(4)):
                point = JointTrajectoryPoint(
                    positions=[self.number() for _ in range(self.chance.choice((0, 1, 1, 2)))],
                    velocities=[self.number() for _ in range(self.chance.choice((0, 0, 1)))],
                )
                point.time_from_start.sec = self.chance.choice((-1, 0, 1, 2**31 - 1))
                message.points.append(point)
            self.robot.send_message('strain_trajectory', message)

    def parameter(self):
        kind = self.chance.choice((0, 1, 2, 2, 3, 3, 3, 4, 4, 9, 200))
        path = self.chance.choice(PATHS).format(folder=self.folder)
        value = ParameterValue(
            type=kind,
            bool_value=self.chance.random() < 0.5,
            integer_value=self.chance.choice((0, 1, 3, -5, 2**62)),
            double_value=self.number(),
            string_value=self.chance.choice((path, 'bits_2', 'pefrl', 'both', 'warn')),
        )
        request = SetParameters.Request(
            parameters=[Parameter(name=self.chance.choice(self.names), value=value)]
        )
        self.send('set_parameters', request, SetParameters)

    def transition(self):
        request = ChangeState.Request()
        # Shutting down would end the storm; a random one is rarely open.
        request.transition.id = self.chance.choice((0, 1, 2, 3, 3, 3, 3, 4, 8, 10, 61, 255))
        self.send('change_state', request, ChangeState)


@pytest.mark.parametrize('length', sampled((150, 20_000), lambda length: length == 150))
def test_the_node_survives_a_storm(start, tmp_path, length):
    node = start(
        {
            'scale.time': 1e-6,
            'time.speed': 0.0,
            'state.path': str(tmp_path / 'element.json'),
            'files.root': str(tmp_path),
        },
        apart=True,
    )
    with Robot() as robot:
        storm = Storm(robot, tmp_path, seed=length)
        for number in range(length):
            storm.act()
            if number % 2 == 0:  # rclpy's own services keep ten requests
                storm.calm()
        for configure_and_activate in (1, 3):
            request = ChangeState.Request()
            request.transition.id = configure_and_activate
            robot.send('change_state', request, ChangeState)
        robot.pause(False)
        robot.wait(lambda: not storm.waiting, storm)
        assert 'error' in robot.trigger('step')  # it answers, active or not
        node.signal(signal.SIGINT)
        assert node.exit_status(60.0) in (ENDED, NOT_SAVED)
    assert 'Traceback' not in node.output
    assert len(node.output) < 300 * length
