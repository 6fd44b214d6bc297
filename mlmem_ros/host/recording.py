# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording: the topics of an element, and what a replay needs, into a bag by a thread, or
before that into the pre-trigger buffer.

A replay begins with the state of an idle device. So the buffer keeps messages in segments, each
beginning with such a state, and drops the oldest once the others reach back far enough.
"""

from __future__ import annotations

import itertools
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from mlmem import MemoryElement, Stamped, atomic_files, threads

from ..bag import jazzy
from ..bag.errors import BagError
from ..bag.writer import BagWriter
from ..session import records
from ..session.records import SessionTopic
from .settings import SessionPlan
from .worker import ThrottledLog

LoggedMessage = tuple[str, bytes, int]
"""Topic, CDR, and log time in nanoseconds."""


class Recording(ABC):
    """What takes all messages of an element.

    Attributes:
        full: Whether the session has ended at its maximum size.
    """

    def __init__(self, plan: SessionPlan, log: ThrottledLog, now: Callable[[], int]) -> None:
        """Create it; `now` returns the time of messages in nanoseconds."""
        self.plan, self.full = plan, False
        self._log = log
        self._now = now
        self._types = {topic.name: topic.type for topic in plan.topics}

    @abstractmethod
    def keep_message(self, message: LoggedMessage) -> object:
        """Keep a message: cheap, never blocks, from any thread."""

    def takes_topic(self, topic: str) -> bool:
        """Return whether messages of a topic are recorded."""
        return topic in self._types and not self.full

    def put(self, topic: str, cdr: bytes) -> None:
        """Take a serialized message, if its topic is recorded; never blocks, from any thread.

        A message of another type would spoil the bag for readers: it is left out and logged.
        """
        if self.takes_topic(topic):
            try:
                trimmed = jazzy.trim_message(cdr, self._types[topic])
            except BagError as error:
                self._log.refused(f'recording {topic}', error)
            else:
                self.keep_message((topic, trimmed, self._now()))

    def put_commands(self, commands: Sequence[Stamped]) -> None:
        """Take the commands of a tick, before its events.

        A recording that is cut anywhere then has the command of every event that it has.
        """
        if not self.full:
            for tick, command in commands:
                self._put_record(SessionTopic.COMMAND, records.build_command(tick, command))

    def record_tick(self, element: MemoryElement) -> None:
        """Take the state's hash if due, after the events of a tick."""
        if element.ticks % self.plan.settings.hash_every == 0:
            self.record_hash(element)

    def record_hash(self, element: MemoryElement) -> None:
        """Take the hash of the present state, between ticks; a real element has none."""
        if element.is_simulated and not self.full:
            self._put_record(SessionTopic.STATE_HASH, records.build_state_hash(element))

    def _put_record(self, topic: SessionTopic, cdr: bytes) -> None:
        self.keep_message((f'{self.plan.node}/{topic}', cdr, self._now()))


@dataclass
class _Segment:
    tick: int
    messages: list[LoggedMessage] = field(default_factory=list)  # the header first
    size: int = 0


class PreTriggerBuffer(Recording):
    """Keeps the last seconds in memory: a ring of segments, as in rosbag2's snapshot mode.

    Time is the element's own, counted in ticks: pace and pauses do not matter. No segment can
    begin while a procedure runs, so a long procedure is kept from its beginning; if it does not
    fit into `max_bytes`, whatever is requested, the ring starts again after it.
    """

    max_bytes = 64 * 2**20

    def __init__(
        self,
        plan: SessionPlan,
        log: ThrottledLog,
        now: Callable[[], int],
        element: MemoryElement,
    ) -> None:
        """Begin with the present state of an idle device."""
        super().__init__(plan, log, now)
        self._tick_seconds = element.settings.tick_seconds
        self._ticks = round(plan.settings.last_seconds / self._tick_seconds)
        self._lock = threads.Lock()  # held for only a few instructions
        self._segments: deque[_Segment] = deque()
        self._tick = 0
        self._size = 0
        self._begin_segment(element)

    def record_tick(self, element: MemoryElement) -> None:
        """Take the state's hash if due; begin a segment if it is time and the device is idle."""
        super().record_tick(element)
        self._tick = element.ticks
        newest = self._segments[-1].tick if self._segments else -self._ticks
        # four segments cover the time, one more is being filled
        if element.ticks - newest >= self._ticks / 4 and not element.procedure:
            self._begin_segment(element)

    def keep_message(self, message: LoggedMessage) -> None:
        """Keep a message in the newest segment, and drop the oldest ones if they take too much."""
        with self._lock:
            if self._segments:
                self._append_message(message)
                while self._size > self.max_bytes:
                    self._drop_segment()

    def list_messages(self) -> list[LoggedMessage]:
        """Return what is kept as one session, with the header of each segment; nothing is kept
        until an idle tick has come.
        """
        with self._lock:
            return [message for part in self._segments for message in part.messages]

    def clear(self) -> None:
        """Discard everything; start again with the next idle tick."""
        with self._lock:
            self._segments.clear()
            self._size = 0

    @property
    def kept(self) -> dict[str, float]:
        """How much is kept, for diagnostics."""
        with self._lock:
            ticks = self._tick - self._segments[0].tick if self._segments else 0
            return {
                'last_seconds': round(ticks * self._tick_seconds, 3),
                'last_bytes': self._size,
            }

    def _begin_segment(self, element: MemoryElement) -> None:
        """Begin a segment, and drop those older than requested."""
        header = build_header(self.plan, element, self._now)
        with self._lock:
            self._tick = element.ticks
            self._segments.append(_Segment(self._tick))
            self._append_message(header)
            while len(self._segments) > 1 and self._tick - self._segments[1].tick >= self._ticks:
                self._drop_segment()

    def _append_message(self, message: LoggedMessage) -> None:
        self._segments[-1].messages.append(message)
        size = len(message[1]) + 200  # memory in addition to the CDR
        self._segments[-1].size += size
        self._size += size

    def _drop_segment(self) -> None:
        self._size -= self._segments.popleft().size


class BagRecording(Recording):
    """Puts a bounded queue and a thread between an element and the bag of a session.

    A sync begins when half of the sync interval has passed since the last one; the other half is
    for the disk.

    When the disk cannot follow and the queue is full, messages are dropped and counted. The
    running count is recorded, as a message of its own whenever it grows, so every gap is known.

    Each file of the bag begins with the state of the idle device, so it can be replayed alone. A
    file that is full while a procedure runs grows until that ends.

    Attributes:
        path: The bag.
        messages: Messages written, including the counts of dropped ones.
        size: Bytes written.
        full_files: Files that have reached the bag's maximum size.
        dropped: Messages refused because too many were waiting.
        error: Why the recording failed, or None.
        max_messages: Most messages that may wait.
        max_bytes: Most bytes that may wait; a larger message still fits alone.
    """

    max_messages = 10_000
    max_bytes = 64 * 2**20

    def __init__(
        self,
        plan: SessionPlan,
        log: ThrottledLog,
        now: Callable[[], int],
        writer: BagWriter,
        before: Sequence[LoggedMessage],
    ) -> None:
        """Record into an open bag with its topics added, which begins with some messages; it
        belongs to the recording from now on.
        """
        super().__init__(plan, log, now)
        self.path = writer.path
        self._writer = writer
        self._sync_after = 0.5 * plan.settings.sync_interval
        self._last_sync = threads.monotonic()
        self._changed = threads.Condition()  # held for a few instructions, never during a write
        self._queue: list[LoggedMessage] = []
        self._queued_bytes = 0
        self.dropped = 0
        self._last_dropped_time = 0
        self._accepting = True
        self.messages = 0
        self.size = 0
        self.full_files = 0
        self._full_files = 0  # that are followed by a header
        self.error: BagError | None = None
        since = f', with the previous {len(before) - 1} messages' if before[1:] else ''
        log.info(f'recording a session into {self.path}{since}')
        self._thread = threads.Thread(
            target=lambda: self._run(before), name='mlmem-recorder', daemon=True
        )
        self._thread.start()

    def keep_message(self, message: LoggedMessage) -> bool:
        """Queue a message; return whether it was accepted. It is not when the queue is full, which
        is counted, or when the recording has failed or is closed.
        """
        _, cdr, log_time = message
        with self._changed:
            if not self._accepting:
                return False
            full = self._queued_bytes + len(cdr) > self.max_bytes and self._queue
            if full or len(self._queue) >= self.max_messages:
                self.dropped += 1
                self._last_dropped_time = log_time
                return False
            self._queue.append(message)
            self._queued_bytes += len(cdr)
            return True

    def record_tick(self, element: MemoryElement) -> None:
        """Take the state's hash if due; begin a file if one is full and the device is idle."""
        super().record_tick(element)
        full_files = self.full_files
        if (
            full_files > self._full_files
            and not (element.procedure or self.full)
            and self.has_margin
            and self.keep_message(build_header(self.plan, element, self._now))
        ):
            self._full_files = full_files

    def record_hash(self, element: MemoryElement) -> None:
        """Take the hash of the present state; it is the last at the session's maximum size."""
        super().record_hash(element)
        most = self.plan.settings.most_megabytes
        if most and not self.full and self.size >= 1e6 * most:
            self.full = True
            self._log.warning(
                f'the session in {self.path} ends at {most:g} MB (record.most_megabytes)'
            )

    @property
    def state(self) -> str:
        """Whether it is ``recording``, has ``failed``, or is ``closed``."""
        if self.error is not None:
            return 'failed'
        return 'recording' if self._thread.is_alive() else 'closed'

    @property
    def has_margin(self) -> bool:
        """Whether messages are accepted, and at least half of the queue is free."""
        few = 2 * len(self._queue) <= self.max_messages
        return self._accepting and few and 2 * self._queued_bytes <= self.max_bytes

    @property
    def queued(self) -> int:
        """Messages that wait."""
        return len(self._queue)

    def close(self) -> None:
        """Accept no more messages, write those that wait, and finish the bag; `error` says whether
        that succeeded.
        """
        with self._changed:
            self._accepting = False
            self._changed.notify_all()
        self._thread.join()

    def _run(self, before: Sequence[LoggedMessage]) -> None:
        """Write what comes before, then what is queued until the recording is closed or fails."""
        stopping, recorded_dropped = False, 0
        try:
            self._write_items(before)
            while not stopping:
                with self._changed:
                    # polled, because a signal would cost the loop time
                    stopping = self._changed.wait_for(lambda: not self._accepting, 0.05)
                    items, self._queue, self._queued_bytes = self._queue, [], 0
                    dropped, dropped_time = self.dropped, self._last_dropped_time
                self._write_items(items)
                if dropped > recorded_dropped:  # after all that fitted into the queue
                    recorded_dropped = dropped
                    cdr = jazzy.encode_message(SessionTopic.DROPPED.type, data=dropped)
                    topic = f'{self.plan.node}/{SessionTopic.DROPPED}'
                    self._writer.write(topic, cdr, dropped_time)
                self._sync_if_due()
                self._update_counts()
            self._writer.close()
            self._update_counts()
        except BagError as error:
            self._fail_recording(error)
        except Exception as error:  # a bug here must end the recording, not the robot
            self._fail_recording(BagError(f'Cannot record into {self.path}: {error!r}.'))

    def _write_items(self, items: Sequence[LoggedMessage]) -> None:
        for item in items:
            self._writer.write(*item)
            self._sync_if_due()

    def _sync_if_due(self) -> None:
        if threads.monotonic() - self._last_sync >= self._sync_after and self._writer.unsynced:
            self._writer.sync()
            self._last_sync = threads.monotonic()

    def _update_counts(self) -> None:
        self.messages = self._writer.message_count
        self.size = self._writer.size
        self.full_files = self._writer.full_files

    def _fail_recording(self, error: BagError) -> None:
        self.error = error
        with self._changed:
            self._accepting = False
            self._queue = []
        with suppress(Exception):  # a bug may raise again, and is told already
            # Finish the bag after a bad message; this does nothing if the storage failed.
            self._writer.close()
        self._log.error(f'recording stopped: {error}')


def build_header(
    plan: SessionPlan, element: MemoryElement, now: Callable[[], int]
) -> LoggedMessage:
    """Return the state of a device, with which a session begins; raise `Refused` unless idle."""
    header = records.build_header(element, plan.node, plan.parameters or {})
    return f'{plan.node}/{SessionTopic.HEADER}', header, now()


def open_bag(plan: SessionPlan) -> BagWriter:
    """Create the bag of a session, with its topics; waits for the disk.

    Raises:
        BagError: It cannot be written.
        SettingsError: The path leads out of `files.root`.
    """
    writer = BagWriter(new_path(plan), max_bytes=plan.settings.max_bytes)
    for topic in plan.topics:
        writer.add_topic(topic.name, topic.type, topic.qos.reliability, topic.qos.durability)
    for own in SessionTopic:
        first = own is SessionTopic.HEADER
        durability = 'transient_local' if first else 'volatile'
        writer.add_topic(f'{plan.node}/{own}', own.type, durability=durability, begins_file=first)
    return writer


def new_path(plan: SessionPlan) -> Path:
    """Return the configured path; with the time added if it is empty or exists."""
    path = plan.files.confine_path(plan.settings.path or 'session')
    if plan.settings.path and not atomic_files.path_exists(path):
        return path
    stamp = time.strftime('%Y%m%d-%H%M%S', time.localtime(threads.time()))
    for number in itertools.count(1):
        named = path.with_name(f'{path.name}-{stamp}' + (f'-{number}' if number > 1 else ''))
        if not atomic_files.path_exists(named):
            break
    return named
