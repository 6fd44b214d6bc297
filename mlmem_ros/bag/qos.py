# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Offered quality of service, as rosbag2 Jazzy spells it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

from ..clipped import clipped
from .errors import BagError
from .yaml_text import Node, dump, load

INFINITE = 2**63 - 1
"""An unlimited duration in nanoseconds (RMW_DURATION_INFINITE)."""

_NANOSECONDS = 1_000_000_000

# The words of each policy at the index of their rmw enumerator, for bags before version 9
# hold the numbers.
_POLICIES = {
    'history': ('system_default', 'keep_last', 'keep_all', 'unknown'),
    'reliability': ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available'),
    'durability': ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available'),
    'liveliness': (
        'system_default',
        'automatic',
        'manual_by_node',
        'manual_by_topic',
        'unknown',
        'best_available',
    ),
}
_DURATIONS = ('deadline', 'lifespan', 'liveliness_lease_duration')
# "Unlimited" as Fast DDS and Connext spelled it before Galactic.
_FOXY_INFINITE = ((0x7FFFFFFF, 0xFFFFFFFF), (0x7FFFFFFF, 0x7FFFFFFF))


@dataclass(frozen=True)
class QosProfile:
    """What a publisher offered. Durations are in nanoseconds.

    History and depth default to ``unknown`` and 0: discovery does not carry them, so that is
    what ``ros2 bag record`` writes too.

    Raises:
        BagError: A policy is not one that ROS names.
    """

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    deadline: int = INFINITE
    lifespan: int = INFINITE
    liveliness: str = 'automatic'
    liveliness_lease_duration: int = INFINITE
    avoid_ros_namespace_conventions: bool = False

    def __post_init__(self) -> None:
        for policy, words in _POLICIES.items():
            if getattr(self, policy) not in words:
                raise BagError(
                    f'QoS {policy} must be one of {", ".join(words)}; '
                    f'got {getattr(self, policy)!r}.'
                )

    def node(self) -> Node:
        """Return the profile as a YAML mapping with rosbag2's key order."""
        return {
            field.name: _duration_node(getattr(self, field.name))
            if field.name in _DURATIONS
            else getattr(self, field.name)
            for field in fields(self)
        }


RELIABLE = QosProfile()
"""Reliable and volatile, the default of ROS publishers."""

LATCHED = QosProfile(durability='transient_local')
"""Reliable and transient local: late subscribers still get the last message."""

SENSOR_DATA = QosProfile(reliability='best_effort')
"""Best effort and volatile: a late sample is worth less than the next."""


@lru_cache(maxsize=256)  # most topics offer the same
def dump_profiles(profiles: tuple[QosProfile, ...]) -> str:
    """Write ``offered_qos_profiles`` as rosbag2 puts it into a channel's metadata.

    Args:
        profiles: One profile for each publisher that was seen.

    Returns:
        YAML text without a final newline.
    """
    return dump([profile.node() for profile in profiles])


def parse_profiles(text: str) -> tuple[QosProfile, ...]:
    """Read ``offered_qos_profiles`` of any rosbag2 version.

    Args:
        text: YAML text; policies as words (version 9) or as numbers (before).

    Returns:
        The profiles; none when the text is empty.

    Raises:
        BagError: The text is not a list of QoS profiles.
    """
    return profiles_of(load(text))


def profiles_of(node: object) -> tuple[QosProfile, ...]:
    """Build profiles from a parsed YAML sequence whose scalars are strings.

    Args:
        node: A sequence of mappings.

    Returns:
        The profiles, in order.

    Raises:
        BagError: The node has another form.
    """
    if not node:
        return ()
    try:
        return tuple(_profile(item) for item in node)  # type: ignore[attr-defined]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BagError(
            f'offered_qos_profiles must be a list of QoS profiles; got {clipped(node)}.'
        ) from error


def _profile(item: dict[str, Any]) -> QosProfile:
    return QosProfile(
        history=_word('history', item['history']),
        depth=int(item['depth']),
        reliability=_word('reliability', item['reliability']),
        durability=_word('durability', item['durability']),
        deadline=_nanoseconds(item['deadline']),
        lifespan=_nanoseconds(item['lifespan']),
        liveliness=_word('liveliness', item['liveliness']),
        liveliness_lease_duration=_nanoseconds(item['liveliness_lease_duration']),
        avoid_ros_namespace_conventions=item['avoid_ros_namespace_conventions'] == 'true',
    )


def _word(policy: str, value: str) -> str:
    words = _POLICIES[policy]
    if value.lstrip('-').isdigit():
        # A reader maps newer enumerators and garbage to "unknown".
        return words[int(value)] if 0 <= int(value) < len(words) else 'unknown'
    return value if value in words else 'unknown'


def _nanoseconds(time: dict[str, str]) -> int:
    seconds, nanoseconds = int(time['sec']), int(time['nsec'])
    if (seconds, nanoseconds) in _FOXY_INFINITE:
        return INFINITE
    return seconds * _NANOSECONDS + nanoseconds


def _duration_node(nanoseconds: int) -> Node:
    return {'sec': nanoseconds // _NANOSECONDS, 'nsec': nanoseconds % _NANOSECONDS}
