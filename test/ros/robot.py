# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot's side of the contract, written from the tables of the public interface alone."""

from __future__ import annotations

import json
import time
from collections import defaultdict
from contextlib import contextmanager
from functools import cache, cached_property

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_msgs.srv import SelfTest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import (
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from sensor_msgs.msg import Image, Imu, JointState, Range
from std_msgs.msg import Empty, Float32MultiArray, Float64, Float64MultiArray, Int16, Int64, UInt8
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import MarkerArray

from mlmem import element_file

RELIABLE = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
EVERY_ONE = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
"""For a client with many requests under way: rclpy's default keeps the last ten answers."""

IN = {
    'strain': Float64,
    'strain_trajectory': JointTrajectory,
    'joint_commands': JointState,
    'probe': Empty,
    'write_level': UInt8,
    'disturbance': Imu,
}
REGISTER_OUT = {'word': (Int64, LATCHED)}
OUT = {
    'level': (Int16, LATCHED),
    'content': (DiagnosticStatus, LATCHED),
    'outcome': (DiagnosticStatus, LATCHED),
    'echo': (Float32MultiArray, RELIABLE),
    'range': (Range, RELIABLE),
    'joint_states': (JointState, RELIABLE),
    'field': (Float32MultiArray, RELIABLE),
    'wall': (Float64MultiArray, RELIABLE),
    'image': (Image, RELIABLE),
    'markers': (MarkerArray, RELIABLE),
    '/diagnostics': (DiagnosticArray, RELIABLE),
}
SERVICES = {
    **dict.fromkeys(('write', 'read', 'erase', 'calibrate', 'locate', 'survey'), Trigger),
    **dict.fromkeys(('reset', 'abort', 'step'), Trigger),
    **dict.fromkeys(('pause', 'record'), SetBool),
    'self_test': SelfTest,
    'request': SetParametersAtomically,
}
PATIENCE = 90.0
"""Seconds to wait for anything: on a busy machine a node takes long to start."""

BLANK = -1
CELL = 0.01
"""Metres from cell to cell."""


def type_name(kind):
    """Return the name of a type of message or service, such as std_msgs/msg/Int16."""
    package, folder, _ = kind.__module__.split('.')
    return f'{package}/{folder}/{kind.__name__}'


class JsonAnswer(dict):
    """The JSON object of a service's answer, and whether it succeeded."""

    def __init__(self, response):
        if isinstance(response, SetParametersAtomically.Response):
            self.success, message = response.result.successful, response.result.reason
        else:
            self.success, message = response.success, response.message
        super().__init__(json.loads(message))


@cache
def common():
    """Return the context of all robots: each takes 40 ms of processor time to join the graph."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    return context


class Robot:
    """A client of one element. It waits with deadlines and keeps every message it receives."""

    def __init__(self, element='/mlmem'):
        self.element, context = element, common()
        self.node = rclpy.create_node(
            'robot',
            context=context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._clients, self._publishers, self._subscriptions = {}, {}, {}
        self._received = defaultdict(list)

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def name(self, name):
        return name if name.startswith('/') else f'{self.element}/{name}'

    # Waiting

    def wait(self, condition, what):
        """Spin until a condition holds; return what it returned."""
        deadline = time.monotonic() + PATIENCE
        while not (value := condition()):
            remaining = deadline - time.monotonic()
            assert remaining > 0.0, f'{what}: not within {PATIENCE:g} s'
            self._executor.spin_once(
                timeout_sec=min(remaining, 0.02)
            )  # news of the graph wakes no one
        return value

    # Topics

    def received(self, topic):
        """Return the list of messages of a topic, which grows while the robot waits.

        It holds everything that has arrived. The node publishes what happened before it answers,
        so nothing older arrives after an answer.
        """
        kind, qos = (OUT | REGISTER_OUT)[topic]
        messages = self._received[topic]
        if topic not in self._subscriptions:
            self._subscriptions[topic] = self.node.create_subscription(
                kind, self.name(topic), messages.append, qos
            )
            self.wait(
                lambda: self.node.count_publishers(self.name(topic)), f'a publisher of {topic}'
            )
        queue = self._subscriptions[topic].handle
        with queue:
            for _ in range(RELIABLE.depth):  # a stream may come as fast as it is taken
                if (taken := queue.take_message(kind, False)) is None:
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

    def send_message(self, topic, message):
        if topic not in self._publishers:
            publisher = self.node.create_publisher(IN[topic], self.name(topic), RELIABLE)
            self._publishers[topic] = publisher
            self.wait(publisher.get_subscription_count, f'a subscriber of {topic}')
        self._publishers[topic].publish(message)

    def publish(self, topic, *value):
        message = IN[topic](data=value[0]) if value else IN[topic]()
        self.send_message(topic, message)

    @cached_property
    def length(self):
        """Displacement of the end in metres at a strain of 1."""
        return CELL * element_file.parse(self.get('element_description'), 'it').design.N

    def follow(self, *points):
        """Publish a trajectory of points (milliseconds, strain) or (milliseconds, strain, 1/s).

        On the wire they are metres of the end and m/s.
        """
        message = JointTrajectory(joint_names=['substrate'])
        for milliseconds, strain, *rate in points:
            point = JointTrajectoryPoint(
                positions=[strain * self.length], velocities=[each * self.length for each in rate]
            )
            point.time_from_start.sec, remaining = divmod(milliseconds, 1000)
            point.time_from_start.nanosec = 10**6 * remaining
            message.points.append(point)
        self.send_message('strain_trajectory', message)

    # Services

    def send(self, service, request=None, kind=None):
        """Send a request; return the future of its answer."""
        kind = kind or SERVICES[service]
        return self._client(service, kind).call_async(request or kind.Request())

    def _client(self, service, kind=None):
        if service not in self._clients:
            self._clients[service] = self.node.create_client(
                kind or SERVICES[service], self.name(service), qos_profile=EVERY_ONE
            )
        client = self._clients[service]
        self.wait(client.service_is_ready, f'service {service}')
        return client

    def response(self, future):
        self.wait(future.done, 'an answer')
        return future.result()

    def answer(self, future):
        return JsonAnswer(self.response(future))

    def trigger(self, service):
        return self.answer(self.send(service))

    def pause(self, hold):
        return self.answer(self.send('pause', SetBool.Request(data=hold)))

    @contextmanager
    def paused(self):
        """Time stands still in the block; it goes on, whatever happens there."""
        self.pause(True)
        try:
            yield
        finally:
            self.pause(False)

    def record(self, on):
        return self.answer(self.send('record', SetBool.Request(data=on)))

    def ask(self, request, **arguments):
        """Send a request that carries its arguments; return the future of its answer."""
        parameters = [
            Parameter(name, value=value).to_parameter_msg()
            for name, value in {'request': request, **arguments}.items()
        ]
        return self.send('request', SetParametersAtomically.Request(parameters=parameters))

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

    # Life cycle

    @property
    def state(self):
        """Label of the node's present state."""
        answer = self.response(self.send('get_state', GetState.Request(), GetState))
        return answer.current_state.label

    def request_transition(self, name):
        """Request a transition such as `configure`; return the future of its answer."""
        number = getattr(Transition, f'TRANSITION_{name.upper()}')
        request = ChangeState.Request(transition=Transition(id=number))
        return self.send('change_state', request, ChangeState)

    def change_state(self, *names):
        """Pass transitions in turn; all must succeed."""
        for name in names:
            assert self.response(self.request_transition(name)).success, name

    # Parameters

    def set(self, **values):
        """Set parameters, a dot written as two underscores; all must be accepted."""
        for name, value in values.items():
            result = self.try_set(name.replace('__', '.'), value)
            assert result.successful, result.reason

    def try_set(self, name, value):
        parameter = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[parameter])
        return self.response(self.send('set_parameters', request, SetParameters)).results[0]

    def get(self, name):
        return self._values([name])[0]

    def parameters(self):
        """Return every parameter and its value."""
        request = ListParameters.Request()
        names = self.response(self.send('list_parameters', request, ListParameters)).result.names
        return dict(zip(names, self._values(names), strict=True))

    def _values(self, names):
        request = GetParameters.Request(names=names)
        answer = self.response(self.send('get_parameters', request, GetParameters))
        return list(map(parameter_value_to_python, answer.values))


class ActionTool:
    """rclpy's client of an action, as any tool has it; its robot spins it.

    Attributes:
        messages: All feedback: the client itself drops what comes after the end.
    """

    def __init__(self, robot, name, kind):
        self.robot, self.kind, self.messages = robot, kind, []
        path = robot.name(name)
        self._client = ActionClient(robot.node, kind, path)
        robot.wait(self._client.server_is_ready, f'the action {name}')
        self._subscription = robot.node.create_subscription(
            kind.Impl.FeedbackMessage, f'{path}/_action/feedback', self.messages.append, EVERY_ONE
        )

    def close(self):
        self._client.destroy()
        self.robot.node.destroy_subscription(self._subscription)

    def send(self, **goal):
        """Send a goal; return its handle once it is accepted."""
        handle = self.robot.response(self._client.send_goal_async(self.kind.Goal(**goal)))
        assert handle.accepted
        return handle

    def result(self, handle):
        return self.robot.response(handle.get_result_async())

    def do(self, **goal):
        return self.result(self.send(**goal))

    def feedback(self, handle):
        """Return the feedback of a goal so far."""
        return [each.feedback for each in self.messages if each.goal_id == handle.goal_id]


def values(status):
    """Return the key/values of a diagnostic status as a mapping."""
    return {pair.key: pair.value for pair in status.values}
