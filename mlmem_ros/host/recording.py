# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One session file: the topics of an element, and what a replay needs beside them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ..bag.definitions import jazzy
from ..bag.errors import BagError
from ..bag.qos import LATCHED, RELIABLE, QosProfile
from ..bag.recorder import Recorder, RecorderStatus
from ..bag.writer import BagWriter
from ..device import MemoryElement
from ..device.loop import Stamped
from ..session import messages
from .journal import Journal
from .session_plan import SessionPlan


class Recording:
    """A session file: made with all its topics, begun and ended between two ticks, closed.

    Attributes:
        full: Whether it has ended by itself at its greatest size.
    """

    def __init__(
        self, plan: SessionPlan, path: Path, journal: Journal, now: Callable[[], int]
    ) -> None:
        """Make the bag; it waits for the disk.

        Args:
            plan: What it shall hold.
            path: The bag; must not exist.
            journal: Where it is told how it goes.
            now: The time in nanoseconds that messages are stamped with.

        Raises:
            BagError: The path exists, or cannot be written.
        """
        self.full = False
        self._plan = plan
        self._journal = journal
        self._now = now
        self._names = messages.SessionTopics.of(plan.node)
        settings = plan.settings
        writer = BagWriter(
            path,
            sync_interval=settings.sync_interval,
            max_bytes=settings.max_bytes,
            max_duration=settings.max_duration,
        )
        self._types = {topic.name: topic.type for topic in plan.topics}
        for topic in plan.topics:
            qos = QosProfile(reliability=topic.qos.reliability, durability=topic.qos.durability)
            writer.add_topic(topic.name, topic.type, (qos,))
        writer.add_topic(self._names.header, messages.STRING, (LATCHED,), latch=True)
        for name in (self._names.command, self._names.state_hash):
            writer.add_topic(name, messages.STRING, (RELIABLE,))
        self._recorder = Recorder(
            writer, dropped_topic=f'{plan.node}/{messages.DROPPED}', on_error=self._tell
        )
        journal.info(f'recording a session into {writer.path}')

    def begin(self, element: MemoryElement) -> None:
        """Record the present state, from which a replay starts; to be called between ticks.

        Raises:
            Refused: A procedure runs.
        """
        given = self._plan.parameters or {}
        self._put(self._names.header, messages.header(element, self._plan.node, given))

    def takes(self, topic: str) -> bool:
        """Return whether the messages of a topic go into this session."""
        return topic in self._types and not self.full

    def put(self, topic: str, cdr: bytes) -> None:
        """Take a message as it goes over the wire, if it is wanted; never waits.

        One that is no message of its topic's type would spoil the bag for its readers: it is
        left out, which is told.
        """
        if self.takes(topic):
            try:
                trimmed = jazzy().trim(cdr, self._types[topic])
            except BagError as error:
                self._journal.refused(f'recording {topic}', error)
            else:
                self._put(topic, trimmed)

    def tick(self, element: MemoryElement, commands: Sequence[Stamped]) -> None:
        """Record the commands of a tick, and the state's hash where it is due."""
        if self.full:
            return
        for tick, command in commands:
            self._put(self._names.command, messages.command(tick, command))
        settings = self._plan.settings
        if element.ticks % settings.hash_every == 0:
            self._put(self._names.state_hash, messages.state_hash(element))
            most = settings.most_megabytes
            if most and self.status.size >= 1e6 * most:  # the hash just recorded is the last
                self.full = True
                self._journal.warning(
                    f'the session in {self.status.path} ends at {most:g} MB '
                    '(record.most_megabytes)'
                )

    def end(self, element: MemoryElement) -> None:
        """Record the hash of the last state; to be called between ticks."""
        if not self.full:
            self._put(self._names.state_hash, messages.state_hash(element))

    def close(self) -> None:
        """Write what waits and finish the bag; it waits for the disk.

        Raises:
            BagError: The recording has failed, now or before.
        """
        status = self._recorder.close()
        if status.error is not None:
            raise status.error
        self._journal.info(
            f'session closed: {status.messages} messages, {status.size / 1e6:.2f} MB, '
            f'{status.dropped} dropped, in {status.path}'
        )

    @property
    def status(self) -> RecorderStatus:
        """How the recording stands."""
        return self._recorder.status

    def _put(self, topic: str, cdr: bytes) -> None:
        self._recorder.put(topic, cdr, self._now())

    def _tell(self, error: BagError) -> None:
        self._journal.error(f'recording stopped: {error}')
