# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the device publishes, as numbers and texts: for `messages`, and for a replay to compare.

No ROS here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mlmem import UNDECODABLE, EchoReceived, Event, MemoryElement, Outcome, Reading, Shot
from mlmem.physics import find_walls
from mlmem.physics.potential import Array

from . import topics
from .answers import outcome_to_dict
from .topics import Topic

SHOT_HEAD_SIZE = 9
"""Numbers that describe a shot, before its samples."""


def collect_published(event: Event, element: MemoryElement) -> dict[Topic, Any]:
    """Return what an event publishes, by topic in their order."""
    if isinstance(event, EchoReceived):
        return {topics.ECHO_TOPIC: event.echo, topics.RANGE_TOPIC: event.reading}
    if isinstance(event, Shot):
        return {topics.WAVEFORM_TOPIC: event}
    content = published_content(element)
    return {topics.OUTCOME_TOPIC: event, **content} if isinstance(event, Outcome) else content


def published_content(element: MemoryElement) -> dict[Topic, Any]:
    """Return what says the content, by topic: the level of one wall or the word of a register."""
    number = topics.LEVEL_TOPIC if not element.reader.holds_words else topics.WORD
    return {number: element.reading, topics.CONTENT_TOPIC: element}


def encode_level(reading: Reading | None) -> int:
    """Return the content: a level or word from 0, -1 blank, -2 undecodable or unknown."""
    return UNDECODABLE if reading is None else reading.level


def describe_content(element: MemoryElement) -> tuple[str, dict[str, str]]:
    """Return the content in words and its values as texts, or why it is not known."""
    reading, unknown = element.reading, element.unknown
    if reading is not None:
        found = {element.content_name: str(reading.content)}
        if reading.reason:
            found['reason'] = reading.reason
        why = f': {reading.reason}' if reading.level == UNDECODABLE else ''
        return element.describe_content(reading.content) + why, found
    found = {element.content_name: str(UNDECODABLE)}
    if unknown is None:
        return 'not read yet', found
    return str(unknown), found | {'reason': unknown.reason, 'since': str(unknown.since)}


def compute_distance(reading: Reading, element: MemoryElement) -> float:
    """Return the distance from the probed end to the wall in m, infinite when there is none."""
    return reading.distance * element.settings.scale.length


def find_wall_positions(element: MemoryElement) -> list[float]:
    """Return the true positions of all walls in sites, from left to right."""
    found = find_walls(element.design, element.chain.configuration)
    return [wall.position for wall in found]


def measure_joints(element: MemoryElement) -> tuple[tuple[float, ...], ...]:
    """Return positions (m), speeds (m/s) and efforts (N) of the substrate's end and of v_1.

    There are no efforts if the driver measures none.
    """
    units, driver = element.units, element.driver
    force = driver.force()
    return (
        (driver.V_N * units.length, driver.end(1) * units.length),
        (element.substrate_speed * units.speed, element.transducer.speed * units.speed),
        () if force is None else (force * units.force, 0.0),
    )


def encode_shot(shot: Shot) -> Array:
    """Return a shot as the numbers of its message, `SHOT_HEAD_SIZE` of them before its samples."""
    head = (
        shot.end.row, shot.omega_c, shot.A, shot.sigma, shot.wall, shot.strain, shot.dt, *shot.rest
    )  # fmt: skip
    return np.concatenate((head, shot.samples.ravel()))


def describe_outcome(outcome: Outcome) -> tuple[str, dict[str, str]]:
    """Return how a procedure ended in words, and its values as texts."""
    text = f'{outcome.procedure} succeeded' if outcome.success else outcome.error
    return text, format_values(outcome_to_dict(outcome))


def format_values(values: Mapping[str, Any]) -> dict[str, str]:
    """Return values as the texts that diagnostics carry.

    Lists are separated by spaces, and a mapping is one text for each of its keys, such as
    `delays_left`. None has none.
    """
    found: dict[str, str] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            found |= format_values({f'{key}_{name}': item for name, item in value.items()})
        elif isinstance(value, list | tuple):
            found[key] = ' '.join(map(_format_value, value))
        elif value is not None:
            found[key] = _format_value(value)
    return found


def _format_value(value: Any) -> str:
    return f'{value:.6g}' if isinstance(value, float) else str(value)
