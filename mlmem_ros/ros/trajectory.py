# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The message of a timed strain profile, as robot code sends it."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ..device.commands import JOINT


def message_of(
    times: Sequence[float], strains: Sequence[float], rates: Sequence[float]
) -> JointTrajectory:
    """Return the message of a profile; whether it can be followed is the node's to judge.

    Args:
        times: Seconds from the beginning of every point.
        strains: Strain of every point.
        rates: Its rate in 1/s; none for straight lines.

    Raises:
        ValueError: A time that no message can hold, or columns of different lengths.
    """
    if len(strains) != len(times) or len(rates) not in (0, len(times)):
        raise ValueError(
            f'every time must have one strain, and one rate or none; got {len(times)} times, '
            f'{len(strains)} strains and {len(rates)} rates'
        )
    message = JointTrajectory(joint_names=[JOINT])
    for number, (time, strain) in enumerate(zip(times, strains, strict=True)):
        if not 0.0 <= time < 2.0**31:  # of builtin_interfaces/msg/Duration; false for NaN, too
            raise ValueError(f'a time must be from 0 s to 2^31 s; got {time!r}')
        seconds, nanoseconds = divmod(round(1e9 * time), 10**9)
        point = JointTrajectoryPoint(
            positions=[float(strain)],
            velocities=[float(rate) for rate in rates[number : number + 1]],
            time_from_start=Duration(sec=seconds, nanosec=nanoseconds),
        )
        message.points.append(point)
    return message
