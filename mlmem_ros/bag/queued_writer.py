# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Record from a real-time loop: the loop queues messages, a thread writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress

from mlmem import threads

from . import jazzy
from .errors import BagError
from .writer import BagWriter

LoggedMessage = tuple[str, bytes, int]
"""Topic, CDR, and log time in nanoseconds."""


class QueuedWriter:
    """Puts a bounded queue and a thread between a producer and a `BagWriter`.

    A sync begins when half of the sync interval has passed since the last one; the other half is
    for the disk.

    When the disk cannot follow and the queue is full, messages are dropped and counted. The
    running count is recorded, as a message on `dropped_topic` whenever it grows, so every gap is
    known.

    Attributes:
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
        writer: BagWriter,
        *,
        dropped_topic: str,
        before: Iterable[LoggedMessage] = (),
        sync_interval: float = 1.0,
        on_error: Callable[[BagError], object] = lambda error: None,
    ) -> None:
        """Start recording.

        Args:
            writer: An open bag with its topics added. It belongs to the recorder from now on.
            dropped_topic: Topic of the count of dropped messages, a UInt64 of the bag's.
            before: Messages to write first.
            sync_interval: Time in seconds within which a message should be safe on the disk.
            on_error: Called once, from the recorder's thread, if the recording fails.
        """
        self.path = writer.path
        self._writer = writer
        self._dropped_topic = dropped_topic
        self._sync_after = 0.5 * sync_interval
        self._last_sync = threads.monotonic()
        self._on_error = on_error
        self._changed = threads.Condition()  # held for a few instructions, never during a write
        self._queue: list[LoggedMessage] = []
        self._queued_bytes = 0
        self.dropped = 0
        self._last_dropped_time = 0
        self._accepting = True
        self.messages = 0
        self.size = 0
        self.full_files = 0
        self.error: BagError | None = None
        first = list(before)
        self._thread = threads.Thread(
            target=lambda: self._run(first), name='mlmem-recorder', daemon=True
        )
        self._thread.start()

    def put(self, topic: str, cdr: bytes, log_time: int) -> bool:
        """Queue a message, with its time in nanoseconds: cheap, never blocks, never raises. Any
        thread may call it.

        Returns:
            Whether the message was accepted. It is not when the queue is full, which is counted,
            or when the recording has failed or is closed.
        """
        size = len(cdr)
        with self._changed:
            if not self._accepting:
                return False
            full = self._queued_bytes + size > self.max_bytes and self._queue
            if full or len(self._queue) >= self.max_messages:
                self.dropped += 1
                self._last_dropped_time = log_time
                return False
            self._queue.append((topic, cdr, log_time))
            self._queued_bytes += size
            return True

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

    def _run(self, before: list[LoggedMessage]) -> None:
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
                    cdr = jazzy.encode_message('std_msgs/msg/UInt64', data=dropped)
                    self._writer.write(self._dropped_topic, cdr, dropped_time)
                self._sync_if_due()
                self._update_counts()
            self._writer.close()
            self._update_counts()
        except BagError as error:
            self._fail_recording(error)
        except Exception as error:  # a bug here must end the recording, not the robot
            self._fail_recording(BagError(f'Cannot record into {self.path}: {error!r}.'))

    def _write_items(self, items: list[LoggedMessage]) -> None:
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
        with suppress(BagError):
            # Finish the bag after a bad message; this does nothing if the storage failed.
            self._writer.close()
        self._on_error(error)
