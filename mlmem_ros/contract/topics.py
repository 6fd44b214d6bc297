# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The topics of a memory node: names, types and quality of service."""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple


class Qos(NamedTuple):
    """Quality of service, in ROS terms.

    Attributes:
        depth: How many messages are kept for a slow subscriber; 0: all.
        reliability: reliable or best_effort.
        durability: volatile or transient_local.
    """

    depth: int
    reliability: str = 'reliable'
    durability: str = 'volatile'


SENSOR_DATA = Qos(5, reliability='best_effort')
"""For subscribers to a stream of which only the newest sample matters."""

STREAM = Qos(5)
"""For the streams we publish: shallow, and reliable, so that every subscriber matches."""

RELIABLE = Qos(10)
"""Every message counts, for subscribers."""

LATCHED = Qos(1, durability='transient_local')
"""Late subscribers get the last message."""

EVERY_ONE = Qos(0)
"""For requests and their answers: with rclpy's default, more than ten at once lose some."""


class Topic(NamedTuple):
    """A topic.

    Attributes:
        name: Below the node's name.
        type: Type of its messages.
        qos: QoS of the node's publisher or subscription.
        meaning: What a message means, for the reference page.
    """

    name: str
    type: str
    qos: Qos
    meaning: str

    @property
    def interval(self) -> str:
        """The parameter with the ticks between two of its messages, if it is periodic."""
        return f'publish.{self.name}_every'

    @property
    def kind(self) -> Any:
        """The class of its messages, from ROS."""
        package, _, name = self.type.split('/')
        return getattr(import_module(f'{package}.msg'), name)


STRAIN = Topic(
    'strain',
    'std_msgs/msg/Float64',
    RELIABLE,
    'strain set-point, tension positive. The actuator slews to it within `actuator.hand_rate`. '
    'Refused while a procedure runs',
)
STRAIN_TRAJECTORY = Topic(
    'strain_trajectory',
    'trajectory_msgs/msg/JointTrajectory',
    RELIABLE,
    'a timed strain profile for the joint `substrate`, in m and s',
)
JOINT_COMMANDS = Topic(
    'joint_commands',
    'sensor_msgs/msg/JointState',
    RELIABLE,
    'as `~/strain`, but a position of the joint `substrate` in m: what a hardware interface of '
    'ros2_control sends',
)
PROBE = Topic('probe', 'std_msgs/msg/Empty', RELIABLE, 'fire one probe pulse')
WRITE_LEVEL = Topic('write_level', 'std_msgs/msg/UInt8', RELIABLE, 'write this level now')
DISTURBANCE = Topic(
    'disturbance',
    'sensor_msgs/msg/Imu',
    SENSOR_DATA,  # also matches reliable publishers
    'acceleration of the base along the chain (`linear_acceleration.x`, in m/s^2), which shakes '
    'the element; accepted at any time',
)

COMMANDS = (STRAIN, STRAIN_TRAJECTORY, JOINT_COMMANDS, PROBE, WRITE_LEVEL, DISTURBANCE)
"""What the node subscribes to."""

LEVEL = Topic(
    'level',
    'std_msgs/msg/Int16',
    LATCHED,
    'the content as last decoded, published when a procedure ends; -1: blank; -2: undecodable or '
    'unknown, published at once when something may have moved the wall',
)
CONTENT = Topic(
    'content',
    'diagnostic_msgs/msg/DiagnosticStatus',
    LATCHED,
    'what `~/level` says, in words: a level or word, or why it is not known and since which '
    'tick; keys: level, word (of a register), reason, since',
)
OUTCOME = Topic(
    'outcome',
    'diagnostic_msgs/msg/DiagnosticStatus',
    LATCHED,
    'how the last procedure ended, with keys and values (level, code, delay, margins, attempts, '
    'ticks)',
)
ECHO = Topic(
    'echo',
    'std_msgs/msg/Float32MultiArray',
    RELIABLE,
    'one message for each probe pulse; rows: time, displacement v_m, demodulated signal v_c. Not '
    'latched: subscribe before the pulse',
)
WAVEFORM = Topic(
    'waveform',
    'std_msgs/msg/Float64MultiArray',
    RELIABLE,
    'one message for each pulse of a survey. The numbers before `data_offset`: end (0 left, 1 '
    'right), carrier, amplitude, sigma, supposed site of the wall (0: blank), strain, time '
    'between samples, displacement of both ends at rest; then rows v_1 and v_N by sample, NaN '
    'where none was taken',
)
RANGE = Topic(
    'range',
    'sensor_msgs/msg/Range',
    STREAM,
    'distance from the probed end to the domain wall in m; +inf when no echo came back',
)
JOINT_STATES = Topic(
    'joint_states',
    'sensor_msgs/msg/JointState',
    STREAM,
    '`substrate`: displacement (m), speed (m/s) and force (N) of its end; `transducer`: '
    'displacement of the driven cell',
)
FIELD = Topic(
    'field', 'std_msgs/msg/Float32MultiArray', STREAM, 'the configuration Delta_j of every cell'
)
WALL = Topic(
    'wall',
    'std_msgs/msg/Float64MultiArray',
    STREAM,
    'true positions of the domain walls, in sites: ground truth that the device never uses',
)

PERIODIC = (FIELD, WALL, JOINT_STATES)
"""Streams of the element's state; `Topic.interval` of each is a parameter."""

STREAMS = (LEVEL, CONTENT, OUTCOME, ECHO, WAVEFORM, RANGE, JOINT_STATES, FIELD, WALL)
"""What the node publishes."""

IMAGE = Topic(
    'image',
    'sensor_msgs/msg/Image',
    STREAM,
    'the configuration over the last seconds: site upward, time to the right (rgb8)',
)
MARKERS = Topic(
    'markers',
    'visualization_msgs/msg/MarkerArray',
    STREAM,
    'the chain for RViz and Foxglove: cells by phase, substrate, levels, walls, content',
)

VIEWS = (IMAGE, MARKERS)
"""Views for people, made only while somebody subscribes."""

OF_A_SIMULATION = (FIELD, WALL, *VIEWS)
"""Unknown for a real element, and then not published."""

DIAGNOSTICS = Topic(
    '/diagnostics',
    'diagnostic_msgs/msg/DiagnosticArray',
    RELIABLE,
    'health of loop, material, actuator, transducers, memory, faults, twin and recorder, once a '
    'second',
)
"""The one topic that all nodes share."""
