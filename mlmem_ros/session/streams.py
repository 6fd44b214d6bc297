# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The published streams of a session, compared with what a replayed device would publish.

A message carries no tick. But periodic streams are due at multiples of their interval, events come
in order, and every message was written before the hash of its tick or a later one. So the messages
between two hashes are compared one by one.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..contract import topics, values
from ..contract.topics import Topic
from ..device import Event, MemoryElement, Unknown

StreamMessage = tuple[int, Any]
"""The tick of the last hash before a message, or `START`; and its content: an array, or texts."""

START = -1
"""Stands for the tick of the last hash before there is any."""

ROUNDING = 1e-6
"""Greatest difference, in cells, that another build's rounding can cause.

Rounding every displacement at every tick, by four times a processor's rounding, changes the golden
sessions by less than 1e-12 cells. A greater difference has another cause.
"""

PERIODIC: dict[Topic, Callable[[MemoryElement], ArrayLike]] = {
    topics.FIELD: lambda element: element.chain.configuration.astype(np.float32),
    topics.WALL: values.wall_positions,
    topics.JOINT_STATES: lambda element: np.concatenate(values.joints(element)),
}
"""Numbers of the periodic streams."""

NEAR = {topics.JOINT_STATES: 1e-9}
"""Relative difference that does not count: the force is a sum, whose order is that of the BLAS."""

OF_EVENTS: dict[Topic, Callable[[Any, MemoryElement], Any]] = {
    topics.RANGE: lambda reading, element: [np.float32(values.distance(reading, element))],
    topics.WAVEFORM: lambda shot, _: values.numbers(shot),
    topics.LEVEL: lambda reading, _: [values.level(reading)],
    topics.CONTENT: lambda element, _: values.content(element),
    topics.OUTCOME: lambda outcome, _: values.told(outcome),
}
"""Numbers, or texts, of what events publish; an echo's samples are not compared."""


TEXTS = (topics.CONTENT, topics.OUTCOME)
"""What is published as texts, which another build may word or round otherwise."""


@dataclass
class Compared:
    """How the messages of a stream agree.

    Attributes:
        recorded: Messages recorded.
        compared: Those for which the replay has one, or should have one.
        equal: Those that are the same to the bit.
        missing: Messages of the replay that are not in the recording, though it is whole.
        difference: Greatest difference of a number, infinite if there are more or fewer numbers.
    """

    recorded: int = 0
    compared: int = 0
    equal: int = 0
    missing: int = 0
    difference: float = 0.0

    @property
    def exact(self) -> bool:
        """Whether all that was compared is the same to the bit."""
        return self.equal == self.compared and not self.missing

    @property
    def rounded(self) -> bool:
        """Whether differences are no more than another build's rounding."""
        return self.difference <= ROUNDING and not self.missing

    def __str__(self) -> str:
        missing = f' ({self.missing} missing)' if self.missing else ''
        return f'{self.equal} of {self.compared}{missing}'

    def take(self, difference: float) -> None:
        """Count a message that was compared."""
        self.compared += 1
        self.equal += difference == 0.0
        self.difference = max(self.difference, difference)


class Streams:
    """Takes the ticks, events and hashes of a replay.

    If part of the recording is lost, messages of the replay that were not recorded are skipped.
    After the last hash a recording may end anywhere.
    """

    def __init__(
        self,
        recorded: Mapping[str, Sequence[StreamMessage]],
        every: Mapping[str, int],
        found: dict[str, Compared],
        *,
        last_hash: int,
        whole: bool,
        texts: bool,
    ) -> None:
        """Begin at the start of a session.

        Args:
            recorded: Messages by stream, in order; one without any is not compared.
            every: Interval of periodic streams in ticks; others are not compared.
            found: Takes the result by stream.
            last_hash: Tick of the last hash.
            whole: Whether nothing is missing from the recording.
            texts: Whether to compare `TEXTS`.
        """
        self._every = {
            topic: every[topic.name]
            for topic in PERIODIC
            if every.get(topic.name) and topic.name in recorded
        }
        chosen = *self._every, *(topic for topic in OF_EVENTS if texts or topic not in TEXTS)
        self._waiting = {
            topic: deque(recorded[topic.name]) for topic in chosen if topic.name in recorded
        }
        self._found = found
        self._last_hash = last_hash
        self._whole = whole
        self._hashed = START
        self._says_unknown = topics.CONTENT.name in recorded  # sessions before 1.1 do not
        for topic, messages in self._waiting.items():
            found[topic.name] = Compared(len(messages))

    def until_due(self, tick: int) -> int:
        """Return how many ticks there are until the next periodic message."""
        return min((every - tick % every for every in self._every.values()), default=tick + 1)

    def tick(self, element: MemoryElement, events: Sequence[Event]) -> None:
        """Compare what is due after a tick, and its events, as the node publishes them."""
        for topic, every in self._every.items():
            if element.ticks % every == 0:
                self._compare(topic, PERIODIC[topic](element))
        for event in events:
            if isinstance(event, Unknown) and not self._says_unknown:
                continue
            for topic, content in values.published(event, element).items():
                if topic in self._waiting:
                    self._compare(topic, OF_EVENTS[topic](content, element))

    def hashed(self, tick: int) -> None:
        """Take a hash: what is left from before it has no counterpart."""
        for topic, waiting in self._waiting.items():
            while waiting and waiting[0][0] == self._hashed:
                waiting.popleft()
                self._found[topic.name].take(math.inf)
        self._hashed = tick

    def _compare(self, topic: Topic, content: Any) -> None:
        waiting, found = self._waiting[topic], self._found[topic.name]
        if not waiting or waiting[0][0] != self._hashed:
            found.missing += self._whole and self._hashed < self._last_hash
            return
        difference = difference_of(waiting[0][1], content, NEAR.get(topic, 0.0))
        if self._whole or difference <= ROUNDING:  # else it may be the next one's
            waiting.popleft()
            found.take(difference)


def difference_of(one: Any, other: Any, near: float = 0.0) -> float:
    """Return the greatest difference of numbers; infinite for other texts or another shape.

    Numbers that differ by less than the fraction `near` are the same.
    """
    if isinstance(one, tuple):
        return 0.0 if one == other else math.inf
    one, other = np.asarray(one), np.asarray(other)
    if one.shape != other.shape:
        return math.inf
    if np.isclose(one, other, rtol=near, atol=0.0, equal_nan=True).all():
        return 0.0
    with np.errstate(invalid='ignore'):
        difference = float(np.abs(one - other).max())
    return math.inf if math.isnan(difference) else difference
