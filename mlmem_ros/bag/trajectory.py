# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command that a message of type trajectory_msgs/msg/JointTrajectory asks for."""

from __future__ import annotations

from typing import Any

from ..device import FollowTrajectory
from ..device.profile import MOST_POINTS


def command_of(message: Any) -> FollowTrajectory:
    """Return the command, right or wrong: the device judges it.

    Positions are strains, velocities their rates. Stamp, accelerations and efforts are not looked
    at: a trajectory begins when it is taken.

    Args:
        message: A trajectory as rclpy or as `rosbags` gives it.
    """
    points = message.points[: MOST_POINTS + 1]  # one more than may be is too many already
    return FollowTrajectory(
        tuple(
            point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in points
        ),
        tuple(float(strain) for point in points for strain in point.positions),
        tuple(float(rate) for point in points for rate in point.velocities),
        ', '.join(message.joint_names),
    )
