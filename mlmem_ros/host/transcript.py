# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What goes into a session, in memory or on disk."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

from ..bag import jazzy
from ..bag.errors import BagError
from ..device import MemoryElement
from ..device.open_requests import Stamped
from ..session import messages
from .settings import SessionPlan
from .throttled_log import ThrottledLog

Message = tuple[str, bytes, int]
"""Topic, CDR, and log time in nanoseconds."""


class Transcript(ABC):
    """Collects the topics of an element, and what a replay needs."""

    def __init__(self, plan: SessionPlan, log: ThrottledLog, now: Callable[[], int]) -> None:
        """Create it empty; `now` returns the time of messages in nanoseconds."""
        self.plan = plan
        self._log = log
        self._now = now
        self._types = {topic.name: topic.type for topic in plan.topics}

    def takes(self, topic: str) -> bool:
        """Return whether messages of a topic go into this session."""
        return topic in self._types

    def put(self, topic: str, cdr: bytes) -> None:
        """Take a serialized message, if its topic is recorded; never blocks.

        A message of another type would spoil the bag for readers: it is left out and logged.
        """
        if self.takes(topic):
            try:
                trimmed = jazzy.trim(cdr, self._types[topic])
            except BagError as error:
                self._log.refused(f'recording {topic}', error)
            else:
                self._put(topic, trimmed)

    def tick(self, element: MemoryElement, commands: Sequence[Stamped]) -> None:
        """Take the commands of a tick, and the state's hash if due."""
        for tick, command in commands:
            self._put(self._own(messages.COMMAND), messages.command(tick, command))
        if element.ticks % self.plan.settings.hash_every == 0:
            self._put_hash(element)

    def _own(self, topic: str) -> str:
        """Return the full name of one of a session's own topics."""
        return f'{self.plan.node}/{topic}'

    def _header(self, element: MemoryElement) -> Message:
        """Return the present state, from which a replay starts.

        Raises:
            Refused: A procedure runs.
        """
        given = self.plan.parameters or {}
        header = messages.header(element, self.plan.node, given)
        return self._own(messages.HEADER), header, self._now()

    def _put_hash(self, element: MemoryElement) -> None:
        if element.simulated:  # the state of a real element is unknown
            self._put(self._own(messages.STATE_HASH), messages.state_hash(element))

    def _put(self, topic: str, cdr: bytes) -> None:
        self._keep((topic, cdr, self._now()))

    @abstractmethod
    def _keep(self, message: Message) -> None:
        """Take a message; any thread may call it, and it never blocks."""
