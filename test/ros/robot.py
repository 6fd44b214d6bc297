# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot's side of the contract, made of rclpy and the tables from which the reference page is
written.
"""

from __future__ import annotations

import atexit
import json
import time
from collections import defaultdict
from contextlib import contextmanager
from functools import cache

import rclpy
from lifecycle_msgs.msg import Transition
from rclpy.action import ActionClient
from rclpy.parameter import Parameter, parameter_value_to_python
from suite import TIMEOUT_S
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from mlmem_ros.contract.commands import COMMAND_TOPICS
from mlmem_ros.contract.requests import NODE_SERVICES, load_action_types
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.contract.topics import DIAGNOSTICS_TOPIC, Qos, load_interface
from mlmem_ros.ros.middleware import create_events_executor

TOPICS_IN = {topic.name: topic for topic in COMMAND_TOPICS}
SERVICES = {
    **{service.name: service.type for service in NODE_SERVICES},
    'get_state': 'lifecycle_msgs/srv/GetState',
    'change_state': 'lifecycle_msgs/srv/ChangeState',
    'get_parameters': 'rcl_interfaces/srv/GetParameters',
    'set_parameters': 'rcl_interfaces/srv/SetParameters',
    'set_parameters_atomically': 'rcl_interfaces/srv/SetParametersAtomically',
}
"""The type of each service of a node."""

BLANK = -1
LENGTH = 2.25
"""Metres of an element of 225 cells."""


class JsonAnswer(dict):
    """The JSON object of a service's answer, and whether it succeeded."""

    def __init__(self, response):
        if hasattr(response, 'result'):  # of `request`
            self.success, message = response.result.successful, response.result.reason
        else:
            self.success, message = response.success, response.message
        super().__init__(json.loads(message))


@cache
def join_graph():
    """Return a context for many nodes: each takes 40 ms of processor time to join the graph."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    atexit.register(context.try_shutdown)
    return context


class Robot:
    """A client of one element. It waits with deadlines and keeps every message it receives."""

    def __init__(self, element='/mlmem'):
        self.element, context = element, join_graph()
        self.node = rclpy.create_node(
            'robot',
            context=context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._executor = create_events_executor(context)
        self._executor.add_node(self.node)
        self._clients, self._publishers, self._subscriptions = {}, {}, {}
        self._actions = {}
        self._received = defaultdict(list)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for action in self._actions.values():
            action.client.destroy()
        self._executor.shutdown()
        self.node.destroy_node()

    def name(self, name):
        return name if name.startswith('/') else f'{self.element}/{name}'

    def wait(self, condition, what):
        """Spin until a condition holds; return what it returned."""
        deadline = time.monotonic() + TIMEOUT_S
        while not (value := condition()):
            assert time.monotonic() < deadline, f'{what}: not within {TIMEOUT_S:g} s'
            self._executor.spin_once(timeout_sec=0.02)  # news of the graph wakes no one
        return value

    # Topics

    def received(self, topic):
        """Return the list of messages of a topic, which grows while the robot waits.

        It holds everything that has arrived. The node publishes what happened before it answers,
        so nothing older arrives after an answer.
        """
        stream = DIAGNOSTICS_TOPIC if topic == '/diagnostics' else STREAMS[topic]
        messages = self._received[topic]
        if topic not in self._subscriptions:
            qos = Qos.LATCHED if stream.qos is Qos.LATCHED else Qos.RELIABLE
            self._subscriptions[topic] = self.node.create_subscription(
                stream.kind, self.name(topic), messages.append, qos.profile
            )
            self.wait(
                lambda: self.node.count_publishers(self.name(topic)), f'a publisher of {topic}'
            )
        queue = self._subscriptions[topic].handle
        with queue:
            for _ in range(Qos.RELIABLE.depth):  # a stream may come as fast as it is taken
                if (taken := queue.take_message(stream.kind, False)) is None:
                    break
                messages.append(taken[0])
        return messages

    def next(self, topic, condition=lambda message: True):
        """Return the first message from now on that meets the condition."""
        messages = self.received(topic)
        seen = len(messages)
        return self.wait(
            lambda: next((m for m in messages[seen:] if condition(m)), None),
            f'a message on {topic}',
        )

    def latest(self, topic, condition=lambda message: True):
        """Return the newest message as soon as it meets the condition."""
        messages = self.received(topic)
        self.wait(lambda: messages and condition(messages[-1]), f'the right message on {topic}')
        return messages[-1]

    def next_status(self, component, condition=lambda status: True):
        """Return the next diagnostic status of a component that meets the condition."""
        name = f'{self.element[1:]}: {component}'

        def find(array):
            return [each for each in array.status if each.name == name and condition(each)]

        (status,) = find(self.next('/diagnostics', find))
        return status

    def count_refused(self):
        """Return the number of refused requests from a report made after this call."""
        self.next('/diagnostics')  # made before the call, perhaps
        return int(values(self.next_status('loop'))['refused'])

    def send_message(self, topic, message):
        if topic not in self._publishers:
            publisher = self.node.create_publisher(
                TOPICS_IN[topic].kind, self.name(topic), Qos.RELIABLE.profile
            )
            self._publishers[topic] = publisher
            self.wait(publisher.get_subscription_count, f'a subscriber of {topic}')
        self._publishers[topic].publish(message)

    def publish(self, topic, **fields):
        self.send_message(topic, TOPICS_IN[topic].kind(**fields))

    def follow(self, *points):
        """Publish a trajectory of points (milliseconds, strain) or (milliseconds, strain, 1/s).

        On the wire they are metres of the end and m/s.
        """
        message = JointTrajectory(joint_names=['substrate'])
        for milliseconds, strain, *rate in points:
            point = JointTrajectoryPoint(
                positions=[strain * LENGTH], velocities=[each * LENGTH for each in rate]
            )
            point.time_from_start.sec, remaining = divmod(milliseconds, 1000)
            point.time_from_start.nanosec = 10**6 * remaining
            message.points.append(point)
        self.send_message('strain_trajectory', message)

    # Services

    def send(self, service, kind=None, **fields):
        """Send a request with these fields; return the future of its response."""
        kind = kind or load_interface(SERVICES[service])
        if service not in self._clients:
            self._clients[service] = self.node.create_client(
                kind, self.name(service), qos_profile=Qos.KEEP_ALL.profile
            )
        client = self._clients[service]
        self.wait(client.service_is_ready, f'service {service}')
        return client.call_async(kind.Request(**fields))

    def response(self, future):
        self.wait(future.done, 'an answer')
        return future.result()

    def call(self, service, kind=None, **fields):
        return self.response(self.send(service, kind, **fields))

    def answer(self, future):
        return JsonAnswer(self.response(future))

    def trigger(self, service, **fields):
        return JsonAnswer(self.call(service, **fields))

    def pause(self, hold):
        return self.trigger('pause', data=hold)

    @contextmanager
    def paused(self):
        """Time stands still in the block; it goes on, whatever happens there."""
        assert self.pause(True).success
        try:
            yield
        finally:
            assert self.pause(False).success

    def request(self, name, **arguments):
        """Send a request that carries its arguments; return the future of its answer."""
        return self.send('request', parameters=build_parameters(request=name, **arguments))

    def write(self, level):
        self.set(target_level=level)
        return self.trigger('write')

    def begin_strained_write(self, level):
        """Begin a write by strain; return the future of its answer once the element is strained.

        It must take more than a second.
        """
        self.set(target_level=level)
        self.next('joint_states')  # a subscription that has not met the node misses a whole write
        answer = self.send('write')
        self.latest('joint_states', lambda state: answer.done() or abs(state.position[0]) > 0.02)
        assert not answer.done(), answer.result()
        return answer

    def action(self, name):
        if name not in self._actions:
            self._actions[name] = ActionTool(self, name)
        return self._actions[name]

    # Life cycle

    @property
    def state(self):
        """Label of the node's present state."""
        return self.call('get_state').current_state.label

    def request_transition(self, name):
        """Request a transition such as `configure`; return the future of its answer."""
        number = getattr(Transition, f'TRANSITION_{name.upper()}')
        return self.send('change_state', transition=Transition(id=number))

    def change_state(self, *names):
        """Pass transitions in turn; all must succeed."""
        for name in names:
            assert self.response(self.request_transition(name)).success, name

    # Parameters

    def set(self, **given):
        """Set parameters, a dot written as two underscores; all must be accepted."""
        for name, value in given.items():
            result = self.try_set(name.replace('__', '.'), value)
            assert result.successful, result.reason

    def try_set(self, name, value):
        return self.call('set_parameters', parameters=build_parameters(**{name: value})).results[0]

    def get(self, name):
        return parameter_value_to_python(self.call('get_parameters', names=[name]).values[0])


class ActionTool:
    """rclpy's client of an action, as any tool has it; its robot spins it.

    Attributes:
        feedback: The messages since the last goal was sent.
    """

    def __init__(self, robot, name):
        self.robot, self.kind, self.feedback = robot, load_action_types()[name], []
        self.client = ActionClient(robot.node, self.kind, robot.name(name))
        robot.wait(self.client.server_is_ready, f'the action {name}')

    def send(self, **goal):
        """Send a goal; return its handle once it is accepted."""
        self.feedback.clear()
        sent = self.client.send_goal_async(self.kind.Goal(**goal), self.feedback.append)
        handle = self.robot.response(sent)
        assert handle.accepted
        return handle

    def result(self, handle):
        return self.robot.response(handle.get_result_async())

    def do(self, **goal):
        return self.result(self.send(**goal))


def build_parameters(**given):
    """Return the messages of parameters."""
    return [Parameter(name, value=value).to_parameter_msg() for name, value in given.items()]


def values(status):
    """Return the key/values of a diagnostic status as a mapping."""
    return {pair.key: pair.value for pair in status.values}
