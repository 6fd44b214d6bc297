# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One session file: the topics of an element, and what a replay needs."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from .. import durable, threads
from ..bag.errors import BagError
from ..bag.qos import LATCHED, offered
from ..bag.recorder import Recorder, RecorderStatus
from ..bag.writer import BagWriter
from ..device import MemoryElement
from ..device.open_requests import Stamped
from ..session import messages
from .settings import SessionPlan
from .throttled_log import ThrottledLog
from .transcript import Message, Transcript


class Recording(Transcript):
    """A session file.

    It is created with all its topics, begun and ended between two ticks, and closed.

    Attributes:
        full: Whether it has ended at its maximum size.
    """

    def __init__(
        self,
        plan: SessionPlan,
        path: Path,
        log: ThrottledLog,
        now: Callable[[], int],
        before: Sequence[Message] = (),
    ) -> None:
        """Create the bag, with the messages of a session that continues in it; waits for the disk.

        Raises:
            BagError: The path exists, or cannot be written.
        """
        super().__init__(plan, log, now)
        self.full = False
        settings = plan.settings
        writer = BagWriter(
            path,
            max_bytes=settings.max_bytes,
            max_duration=settings.max_duration,
            digests=self._own(messages.DIGEST),
        )
        for topic in plan.topics:
            qos = offered(topic.qos.reliability, topic.qos.durability)
            writer.add_topic(topic.name, topic.type, qos)
        writer.add_topic(self._own(messages.HEADER), messages.STRING, LATCHED, latch=True)
        for name in (messages.COMMAND, messages.STATE_HASH):
            writer.add_topic(self._own(name), messages.STRING)
        for message in before:
            writer.write(*message)
        writer.sync()
        self._recorder = Recorder(
            writer,
            dropped_topic=self._own(messages.DROPPED),
            sync_interval=settings.sync_interval,
            on_error=self._log_error,
        )
        since = f', with the previous {len(before)} messages' if before else ''
        log.info(f'recording a session into {writer.path}{since}')

    def begin(self, element: MemoryElement) -> None:
        """Record the present state, from which a replay starts; call it between ticks.

        Raises:
            Refused: A procedure runs.
        """
        self._keep(self._header(element))

    def go_on(self, since: Sequence[Message]) -> None:
        """Record what came while earlier messages were written; call it between ticks."""
        for message in since:
            self._keep(message)

    def takes(self, topic: str) -> bool:
        """Return whether the messages of a topic go into this session."""
        return not self.full and super().takes(topic)

    def tick(self, element: MemoryElement, commands: Sequence[Stamped]) -> None:
        """Record the commands of a tick, and the state's hash if due."""
        if self.full:
            return
        super().tick(element, commands)
        settings = self.plan.settings
        most = settings.most_megabytes
        hashed = element.ticks % settings.hash_every == 0
        if most and hashed and self.status.size >= 1e6 * most:
            self.full = True  # the hash just recorded is the last
            self._log.warning(
                f'the session in {self.status.path} ends at {most:g} MB (record.most_megabytes)'
            )

    def end(self, element: MemoryElement) -> None:
        """Record the hash of the last state; call it between ticks."""
        if not self.full:
            self._put_hash(element)

    def close(self) -> None:
        """Write what is queued, and finish the bag; waits for the disk.

        Raises:
            BagError: The recording has failed, now or earlier.
        """
        status = self._recorder.close()
        if status.error is not None:
            raise status.error
        self._log.info(
            f'session closed: {status.messages} messages, {status.size / 1e6:.2f} MB, '
            f'{status.dropped} dropped, in {status.path}'
        )

    @property
    def status(self) -> RecorderStatus:
        """Status of the recording."""
        return self._recorder.status

    def _keep(self, message: Message) -> None:
        self._recorder.put(*message)

    def _log_error(self, error: BagError) -> None:
        self._log.error(f'recording stopped: {error}')


def new_path(plan: SessionPlan) -> Path:
    """Return the configured path; with the time added if it is empty or exists."""
    settings, path = plan.settings, plan.files.confined(plan.settings.path or 'session')
    if settings.path and not (settings.add_time and durable.exists(path)):
        return path
    name = f'{path.name}-{time.strftime("%Y%m%d-%H%M%S", time.localtime(threads.time()))}'
    names = (name if number == 1 else f'{name}-{number}' for number in itertools.count(1))
    return next(path.with_name(name) for name in names if not durable.exists(path.with_name(name)))
