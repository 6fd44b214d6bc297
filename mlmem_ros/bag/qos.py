# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Offered quality of service, as rosbag2 Jazzy writes it: YAML text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import yaml  # type: ignore[import-untyped]

_PROFILE = """\
- history: unknown
  depth: 0
  reliability: {}
  durability: {}
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false"""


def offered(reliability: str = 'reliable', durability: str = 'volatile') -> str:
    """Return the QoS of one publisher with unlimited durations.

    History and depth are ``unknown`` and 0, as ``ros2 bag record`` writes them: discovery does
    not carry them.
    """
    return _PROFILE.format(reliability, durability)


RELIABLE = offered()
"""Reliable and volatile, the default of ROS publishers."""

LATCHED = offered(durability='transient_local')
"""Reliable and transient local: late subscribers still get the last message."""


def renewed(text: str) -> str:
    """Return the QoS that any version of rosbag2 wrote as Jazzy writes it; empty if damaged."""
    from rosbags.rosbag2.metadata import parse_qos

    try:
        return dump(parse_qos(text))
    except Exception:  # rosbags raises whatever a wrong type raises; messages do not need it
        return ''


def dump(profiles: Sequence[Any]) -> str:
    """Return profiles of `rosbags` as Jazzy writes them."""
    from rosbags.rosbag2.metadata import dump_qos_v9

    text: str = yaml.safe_dump(dump_qos_v9(list(profiles)), sort_keys=False)
    return text.rstrip('\n')
