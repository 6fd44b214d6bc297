# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Device commands from messages on command topics, live or from a bag."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from mlmem import (
    MAX_PROFILE_POINTS,
    Command,
    Disturb,
    FollowTrajectory,
    MemoryElement,
    Read,
    Refused,
    SetStrain,
)
from mlmem.procedure_table import JOINT_NAME

from .requests import build_command
from .topics import Qos, Topic


class NoCommand(Refused):
    """A message that asks for nothing, and needs no answer."""


Make = Callable[[Any, MemoryElement], Command]
"""Turns a message into a command for an element, from SI into its units, or raises `Refused`."""


def parse_trajectory(message: Any, element: MemoryElement) -> FollowTrajectory:
    """Turn a JointTrajectory, from rclpy or `rosbags`, into a command; the device checks whether
    it can follow it.

    Positions are displacements of the substrate's end in m, as in `~/joint_states`, and velocities
    m/s. Stamp, accelerations and efforts are ignored: a trajectory begins when it is accepted.

    Raises:
        Refused: A point does not have one position, or only some points have one velocity.
    """
    points = message.points[: MAX_PROFILE_POINTS + 1]  # one more than allowed is enough to refuse
    rates = min(1, len(points[0].velocities)) if points else 0
    for number, point in enumerate(points, start=1):
        if len(point.positions) != 1:
            expected = f'one position in every point, also in point {number}'
            raise Refused.out_of_range('positions', len(point.positions), expected)
        if len(point.velocities) != rates:
            expected = f'one velocity in every point or in none, also in point {number}'
            raise Refused.out_of_range('velocities', len(point.velocities), expected)
    strain = element.elongation
    return FollowTrajectory(
        tuple(
            point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in points
        ),
        tuple(float(point.positions[0]) / strain for point in points),
        tuple(float(rate) / strain for point in points for rate in point.velocities),
        ', '.join(message.joint_names),
    )


def parse_joint_state(message: Any, element: MemoryElement) -> SetStrain:
    """Turn a JointState that sets a position, in m, into a command; all else in it is ignored.

    Raises:
        NoCommand: The position is NaN, as ros2_control sends it until a controller commands one.
        Refused: It has no position of the device's joint.
    """
    positions = dict(zip(message.name, message.position, strict=False))
    if JOINT_NAME not in positions:
        expected = f'one of the joint {JOINT_NAME!r}'
        raise Refused.out_of_range('position', list(positions), expected)
    if math.isnan(position := float(positions[JOINT_NAME])):
        raise NoCommand(reason=f'no position of the joint {JOINT_NAME!r} is wanted: it is NaN')
    return SetStrain(position / element.elongation)


def parse_acceleration(message: Any, element: MemoryElement) -> Disturb:
    """Turn an Imu message into the base's acceleration along the chain.

    An Imu without an accelerometer says so by its covariance (REP 145): the result is NaN, which
    the device refuses.
    """
    if message.linear_acceleration_covariance[0] == -1.0:
        return Disturb(math.nan)
    return Disturb(float(message.linear_acceleration.x) / element.settings.scale.acceleration)


def parse_level(message: Any, element: MemoryElement) -> Command:
    """Turn a UInt8 into a write; raise `Refused` if the element holds words, not levels."""
    command: Command = build_command('write', {'level': message.data}, element.content_name)
    return command


@dataclass(frozen=True)
class CommandTopic(Topic):
    """A topic that the node subscribes to.

    Attributes:
        parse: Turns a message into a command.
        is_in_metres: Whether its strains are displacements of the substrate's end in m.
    """

    parse: Make
    is_in_metres: bool = False


COMMAND_TOPICS = (
    CommandTopic(
        'strain',
        'std_msgs/msg/Float64',
        Qos.RELIABLE,
        'strain set-point, tension positive. The actuator slews to it within '
        '`actuator.hand_rate`. Refused while a procedure runs',
        lambda message, _: SetStrain(float(message.data)),
    ),
    CommandTopic(
        'strain_trajectory',
        'trajectory_msgs/msg/JointTrajectory',
        Qos.RELIABLE,
        'a timed strain profile for the joint `substrate`, in m and s',
        parse_trajectory,
        is_in_metres=True,
    ),
    CommandTopic(
        'joint_commands',
        'sensor_msgs/msg/JointState',
        Qos.RELIABLE,
        'as `~/strain`, but a position of the joint `substrate` in m: what a hardware interface '
        'of ros2_control sends',
        parse_joint_state,
        is_in_metres=True,
    ),
    CommandTopic(
        'probe',
        'std_msgs/msg/Empty',
        Qos.RELIABLE,
        'fire one probe pulse',
        lambda message, _: Read(),
    ),
    CommandTopic(
        'write_level',
        'std_msgs/msg/UInt8',
        Qos.RELIABLE,
        'write this level now, to an element with one wall',
        parse_level,
    ),
    CommandTopic(
        'disturbance',
        'sensor_msgs/msg/Imu',
        Qos.SENSOR_DATA,  # also matches reliable publishers
        'acceleration of the base along the chain (`linear_acceleration.x`, in m/s^2), which '
        'shakes the element; accepted at any time',
        parse_acceleration,
    ),
)
"""What the node subscribes to."""
