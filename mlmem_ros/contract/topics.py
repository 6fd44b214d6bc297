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


SENSOR_DATA_QOS = Qos(5, reliability='best_effort')
"""For subscribers to a stream of which only the newest sample matters."""

STREAM_QOS = Qos(5)
"""For the streams we publish: shallow, and reliable, so that every subscriber matches."""

RELIABLE_QOS = Qos(10)
"""Every message counts, for subscribers."""

LATCHED_QOS = Qos(1, durability='transient_local')
"""Late subscribers get the last message."""

KEEP_ALL_QOS = Qos(0)
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


STRAIN_TOPIC = Topic(
    'strain',
    'std_msgs/msg/Float64',
    RELIABLE_QOS,
    'strain set-point, tension positive. The actuator slews to it within `actuator.hand_rate`. '
    'Refused while a procedure runs',
)
STRAIN_TRAJECTORY_TOPIC = Topic(
    'strain_trajectory',
    'trajectory_msgs/msg/JointTrajectory',
    RELIABLE_QOS,
    'a timed strain profile for the joint `substrate`, in m and s',
)
JOINT_COMMANDS_TOPIC = Topic(
    'joint_commands',
    'sensor_msgs/msg/JointState',
    RELIABLE_QOS,
    'as `~/strain`, but a position of the joint `substrate` in m: what a hardware interface of '
    'ros2_control sends',
)
PROBE_TOPIC = Topic('probe', 'std_msgs/msg/Empty', RELIABLE_QOS, 'fire one probe pulse')
WRITE_LEVEL_TOPIC = Topic(
    'write_level', 'std_msgs/msg/UInt8', RELIABLE_QOS, 'write this level now'
)
DISTURBANCE_TOPIC = Topic(
    'disturbance',
    'sensor_msgs/msg/Imu',
    SENSOR_DATA_QOS,  # also matches reliable publishers
    'acceleration of the base along the chain (`linear_acceleration.x`, in m/s^2), which shakes '
    'the element; accepted at any time',
)

COMMAND_TOPICS = (
    STRAIN_TOPIC,
    STRAIN_TRAJECTORY_TOPIC,
    JOINT_COMMANDS_TOPIC,
    PROBE_TOPIC,
    WRITE_LEVEL_TOPIC,
    DISTURBANCE_TOPIC,
)
"""What the node subscribes to."""

LEVEL_TOPIC = Topic(
    'level',
    'std_msgs/msg/Int16',
    LATCHED_QOS,
    'the level of one wall as last decoded, published when a procedure ends; -1: blank; -2: '
    'undecodable or unknown, published at once when something may have moved the wall',
)
WORD = Topic(
    'word',
    'std_msgs/msg/Int64',
    LATCHED_QOS,
    'of a register, in place of `~/level`: the word as last decoded; -1 and -2 as there',
)
CONTENT_TOPIC = Topic(
    'content',
    'diagnostic_msgs/msg/DiagnosticStatus',
    LATCHED_QOS,
    'what `~/level` or `~/word` says, as text: a level or word, or why it is not known and since '
    'which tick; keys: level or word, reason, since',
)
OUTCOME_TOPIC = Topic(
    'outcome',
    'diagnostic_msgs/msg/DiagnosticStatus',
    LATCHED_QOS,
    'how the last procedure ended, with keys and values (level or word, code, delay, margins, '
    'attempts, ticks)',
)
ECHO_TOPIC = Topic(
    'echo',
    'std_msgs/msg/Float32MultiArray',
    RELIABLE_QOS,
    'one message for each probe pulse; rows: time, displacement v_m, demodulated signal v_c. Not '
    'latched: subscribe before the pulse',
)
WAVEFORM_TOPIC = Topic(
    'waveform',
    'std_msgs/msg/Float64MultiArray',
    RELIABLE_QOS,
    'one message for each pulse of a survey. The numbers before `data_offset`: end (0 left, 1 '
    'right), carrier, amplitude, sigma, supposed site of the wall (0: blank), strain, time '
    'between samples, displacement of both ends at rest; then rows v_1 and v_N by sample, NaN '
    'where none was taken',
)
RANGE_TOPIC = Topic(
    'range',
    'sensor_msgs/msg/Range',
    STREAM_QOS,
    'distance from the probed end to the domain wall in m; +inf when no echo came back',
)
JOINT_STATES_TOPIC = Topic(
    'joint_states',
    'sensor_msgs/msg/JointState',
    STREAM_QOS,
    '`substrate`: displacement (m), speed (m/s) and force (N) of its end; `transducer`: '
    'displacement of the driven cell',
)
FIELD_TOPIC = Topic(
    'field',
    'std_msgs/msg/Float32MultiArray',
    STREAM_QOS,
    'the configuration Delta_j of every cell',
)
WALL_TOPIC = Topic(
    'wall',
    'std_msgs/msg/Float64MultiArray',
    STREAM_QOS,
    'true positions of the domain walls, in sites: ground truth that the device never uses',
)

PERIODIC_TOPICS = (FIELD_TOPIC, WALL_TOPIC, JOINT_STATES_TOPIC)
"""Streams of the element's state; `Topic.interval` of each is a parameter."""

STREAM_TOPICS = (
    LEVEL_TOPIC,
    WORD,
    CONTENT_TOPIC,
    OUTCOME_TOPIC,
    ECHO_TOPIC,
    WAVEFORM_TOPIC,
    RANGE_TOPIC,
    JOINT_STATES_TOPIC,
    FIELD_TOPIC,
    WALL_TOPIC,
)
"""What the node publishes."""

IMAGE_TOPIC = Topic(
    'image',
    'sensor_msgs/msg/Image',
    STREAM_QOS,
    'the configuration over the last seconds: site upward, time to the right (rgb8)',
)
MARKERS_TOPIC = Topic(
    'markers',
    'visualization_msgs/msg/MarkerArray',
    STREAM_QOS,
    'the chain for RViz and Foxglove: cells by phase, substrate, levels, walls, content',
)

VIEW_TOPICS = (IMAGE_TOPIC, MARKERS_TOPIC)
"""Views for people, made only while somebody subscribes."""

SIMULATION_TOPICS = (FIELD_TOPIC, WALL_TOPIC, *VIEW_TOPICS)
"""Unknown for a real element, and then not published."""


def published_topics(register: bool, simulated: bool) -> tuple[Topic, ...]:
    """Return the streams and views of an element: of a register, or else of one wall."""
    absent = {LEVEL_TOPIC if register else WORD, *(() if simulated else SIMULATION_TOPICS)}
    return tuple(topic for topic in STREAM_TOPICS + VIEW_TOPICS if topic not in absent)


DIAGNOSTICS_TOPIC = Topic(
    '/diagnostics',
    'diagnostic_msgs/msg/DiagnosticArray',
    RELIABLE_QOS,
    'health of loop, material, actuator, transducers, memory, faults, twin and recorder, once a '
    'second',
)
"""The one topic that all nodes share."""
