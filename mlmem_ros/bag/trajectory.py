# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command that a message of type trajectory_msgs/msg/JointTrajectory asks for."""

from __future__ import annotations

from typing import Any

from ..device import FollowTrajectory, Refused
from ..device.profile import MOST_POINTS


def command_of(message: Any, elongation: float) -> FollowTrajectory:
    """Return the command; whether it can be followed is for the device to judge.

    Positions are displacements of the substrate's end in m, as `~/joint_states` tells them, and
    velocities m/s. Stamp, accelerations and efforts are not looked
    at: a trajectory begins when it is taken.

    Args:
        message: A trajectory as rclpy or as `rosbags` gives it.
        elongation: Displacement of the end for a strain of 1, in m.

    Raises:
        Refused: A point has not one position, or not as many velocities, one or none, as the
            others.
    """
    points = message.points[: MOST_POINTS + 1]  # one more than may be is too many already
    rates = min(1, len(points[0].velocities)) if points else 0
    for number, point in enumerate(points, start=1):
        if len(point.positions) != 1:
            raise Refused(
                f'every point must have one position; got {len(point.positions)} in point {number}'
            )
        if len(point.velocities) != rates:
            raise Refused(
                'either every point or none must have one velocity; '
                f'got {len(point.velocities)} in point {number}'
            )
    return FollowTrajectory(
        tuple(
            point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in points
        ),
        tuple(float(point.positions[0]) / elongation for point in points),
        tuple(float(rate) / elongation for point in points for rate in point.velocities),
        ', '.join(message.joint_names),
    )
