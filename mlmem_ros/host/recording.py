# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording: the topics of an element, and what a replay needs, into one sink."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from .. import durable, threads
from ..bag import jazzy
from ..bag.errors import BagError
from ..bag.metadata import LATCHED, offered
from ..bag.queued_writer import QueuedWriter
from ..bag.writer import BagWriter
from ..device import MemoryElement
from ..device.open_requests import Stamped
from ..session import records
from .pre_trigger import Message, PreTriggerBuffer
from .settings import SessionPlan
from .throttled_log import ThrottledLog


class Recording:
    """Hands messages to a sink: the pre-trigger buffer before a session, or the queue of its bag.

    Attributes:
        full: Whether the session has ended at its maximum size.
    """

    def __init__(
        self,
        plan: SessionPlan,
        log: ThrottledLog,
        now: Callable[[], int],
        sink: PreTriggerBuffer | QueuedWriter,
    ) -> None:
        """Record into a sink; `now` returns the time of messages in nanoseconds."""
        self.plan, self.sink, self.full = plan, sink, False
        self._log = log
        self._now = now
        self._types = {topic.name: topic.type for topic in plan.topics}

    def takes(self, topic: str) -> bool:
        """Return whether messages of a topic are recorded."""
        return topic in self._types and not self.full

    def put(self, topic: str, cdr: bytes) -> None:
        """Take a serialized message, if its topic is recorded; never blocks, from any thread.

        A message of another type would spoil the bag for readers: it is left out and logged.
        """
        if self.takes(topic):
            try:
                trimmed = jazzy.trim(cdr, self._types[topic])
            except BagError as error:
                self._log.refused(f'recording {topic}', error)
            else:
                self.sink.put(topic, trimmed, self._now())

    def tick(self, element: MemoryElement, commands: Sequence[Stamped]) -> None:
        """Take the commands of a tick, and the state's hash if due."""
        if self.full:
            return
        for tick, command in commands:
            self._put(records.COMMAND, records.command(tick, command))
        hashed = element.ticks % self.plan.settings.hash_every == 0
        if hashed:
            self._put_hash(element)
        if isinstance(self.sink, PreTriggerBuffer):
            if self.sink.due(element.ticks) and not element.procedure:
                self.sink.begin(element.ticks, self._header(element))
        elif hashed:
            self._end_if_full(self.sink)

    def begin(self, element: MemoryElement) -> None:
        """Record the present state, from which a replay starts; call it between ticks.

        Raises:
            Refused: A procedure runs.
        """
        self.sink.put(*self._header(element))

    def end(self, element: MemoryElement) -> None:
        """Record the hash of the last state; call it between ticks."""
        if not self.full:
            self._put_hash(element)

    def _own(self, topic: str) -> str:
        return own(self.plan, topic)

    def _header(self, element: MemoryElement) -> Message:
        header = records.header(element, self.plan.node, self.plan.parameters or {})
        return self._own(records.HEADER), header, self._now()

    def _put_hash(self, element: MemoryElement) -> None:
        if element.simulated:  # the state of a real element is unknown
            self._put(records.STATE_HASH, records.state_hash(element))

    def _put(self, topic: str, cdr: bytes) -> None:
        self.sink.put(self._own(topic), cdr, self._now())

    def _end_if_full(self, bag: QueuedWriter) -> None:
        """End a session at its maximum size; the hash just recorded is the last."""
        most = self.plan.settings.most_megabytes
        if most and (status := bag.status).size >= 1e6 * most:
            self.full = True
            self._log.warning(
                f'the session in {status.path} ends at {most:g} MB (record.most_megabytes)'
            )


def own(plan: SessionPlan, topic: str) -> str:
    """Return the full name of one of a session's own topics."""
    return f'{plan.node}/{topic}'


def buffered(
    plan: SessionPlan, log: ThrottledLog, now: Callable[[], int], element: MemoryElement
) -> Recording:
    """Record the last seconds, from the present state of an idle device on, in memory."""
    buffer = PreTriggerBuffer(plan.settings.last_seconds, element.settings.tick_seconds)
    recording = Recording(plan, log, now, buffer)
    buffer.begin(element.ticks, recording._header(element))
    return recording


def opened(
    plan: SessionPlan,
    path: Path,
    log: ThrottledLog,
    now: Callable[[], int],
    before: Sequence[Message] = (),
) -> tuple[Recording, QueuedWriter]:
    """Create the bag of a session, with the messages from before its start, and return a recording
    into it; waits for the disk.

    Raises:
        BagError: The path exists, or cannot be written.
    """
    settings = plan.settings
    writer = BagWriter(
        path,
        max_bytes=settings.max_bytes,
        max_duration=settings.max_duration,
        digests=own(plan, records.DIGEST),
    )
    for topic in plan.topics:
        qos = offered(topic.qos.reliability, topic.qos.durability)
        writer.add_topic(topic.name, topic.type, qos)
    writer.add_topic(own(plan, records.HEADER), records.STRING, LATCHED, latch=True)
    for name in (records.COMMAND, records.STATE_HASH):
        writer.add_topic(own(plan, name), records.STRING)
    for message in before:
        writer.write(*message)
    writer.sync()
    queue = QueuedWriter(
        writer,
        dropped_topic=own(plan, records.DROPPED),
        sync_interval=settings.sync_interval,
        on_error=lambda error: log.error(f'recording stopped: {error}'),
    )
    since = f', with the previous {len(before)} messages' if before else ''
    log.info(f'recording a session into {writer.path}{since}')
    return Recording(plan, log, now, queue), queue


def new_path(plan: SessionPlan) -> Path:
    """Return the configured path; with the time added if it is empty or exists."""
    settings, path = plan.settings, plan.files.confined(plan.settings.path or 'session')
    if settings.path and not (settings.add_time and durable.exists(path)):
        return path
    name = f'{path.name}-{time.strftime("%Y%m%d-%H%M%S", time.localtime(threads.time()))}'
    names = (name if number == 1 else f'{name}-{number}' for number in itertools.count(1))
    return next(path.with_name(name) for name in names if not durable.exists(path.with_name(name)))
