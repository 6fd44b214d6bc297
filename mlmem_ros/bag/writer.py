# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write a bag directory that rosbag2, Foxglove, PlotJuggler and rosbags open."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import IO, cast

from mcap.writer import LIBRARY_IDENTIFIER, IndexType, Writer

from mlmem import atomic_files

from . import jazzy
from .contents import FileInfo, TopicInfo, describe_qos, format_metadata, format_yaml
from .errors import BagError, storage_errors


class BagWriter:
    """Writes one bag: ``NAME/metadata.yaml``, ``NAME/NAME_0.mcap``, ``NAME/NAME_1.mcap`` ...

    All synced data survives a crash of the program or the machine, and ``metadata.yaml`` always
    agrees with the last sync. After a storage error the writer is unusable: every call but `close`
    raises that error again. Only one thread may use it at a time.
    """

    def __init__(self, path: str | PathLike[str], *, max_bytes: int = 0) -> None:
        """Create the bag.

        Args:
            path: Directory of the bag; must not exist. Missing parents are made.
            max_bytes: Once a file has this size, the next message of a topic with `begins_file`
                begins a new one; 0 never does.

        Raises:
            BagError: `max_bytes` is too small, or the path exists or cannot be created.
        """
        if 0 < max_bytes < 1024:  # which rosbag2's MCAP storage refuses, too
            raise BagError(f'max_bytes must be 0 or at least 1024; got {max_bytes}.')
        self.path = Path(path).absolute()
        self._max_bytes = max_bytes
        self._topics: dict[str, TopicInfo] = {}
        self._files: list[FileInfo] = []
        self._channels: dict[str, int] = {}  # by topic, in the file being written
        self._schemas: dict[str, int] = {}  # by type
        self._closed_bytes = 0
        self._error: BagError | None = None
        self._closed = False
        self.unsynced = False
        """Whether some messages are not safe on the disk yet."""
        with storage_errors(f'create {self.path}'):
            try:
                atomic_files.make_directory(self.path)
            except FileExistsError as error:
                raise BagError(
                    f'{self.path} exists already; a bag is never overwritten: choose another path.'
                ) from error
        self._open_file()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def message_count(self) -> int:
        """Messages written so far."""
        return sum(file.message_count for file in self._files)

    @property
    def size(self) -> int:
        """Bytes written so far, without the open chunk."""
        return self._closed_bytes + self._file.tell()

    @property
    def full_files(self) -> int:
        """Number of files that have reached `max_bytes`, with the present one if it has."""
        return len(self._files) - 1 + self._is_file_full()

    def add_topic(
        self,
        name: str,
        type_name: str,
        reliability: str = 'reliable',
        durability: str = 'volatile',
        *,
        begins_file: bool = False,
    ) -> None:
        """Declare a topic, once, before its first message.

        Args:
            reliability: That its publishers offer, as `durability`.
            begins_file: Begin a new file with its next message once the present one is full, so
                that each file of a split bag can be understood alone.

        Raises:
            BagError: The type is not known, the bag is closed, or the storage fails.
        """
        digest = jazzy.find_definition(type_name).hash
        offered = [describe_qos(reliability, durability)]
        topic = TopicInfo(name, type_name, digest, offered_qos=offered, begins_file=begins_file)
        with self._use_file():
            self._declare_channel(topic)
        self._topics[name] = topic

    def write(self, topic: str, cdr: bytes, log_time: int) -> None:
        """Write a message on a topic that was added, with its time in nanoseconds.

        Raises:
            BagError: The time is out of range, the bag is closed, or the storage fails.
        """
        if not 0 <= log_time < 2**63:
            raise BagError(f'A time must be from 0 to 2**63 - 1 ns; got {log_time}.')
        info = self._topics[topic]
        with self._use_file():
            if info.begins_file and self._is_file_full():
                self._close_file()
                self._closed_bytes += self._file.tell()
                self._open_file()
            self._mcap.add_message(self._channels[topic], log_time, cdr, log_time)
            self._files[-1].add(log_time)
            info.message_count += 1
            self.unsynced = True

    def sync(self) -> None:
        """Make all messages so far safe on the disk and update ``metadata.yaml``.

        Raises:
            BagError: The storage fails, or the bag was removed or is closed.
        """
        with self._use_file():
            if self.unsynced:
                self._sync_file(self._mcap.flush)
                self._write_metadata()
        self.unsynced = False

    def close(self) -> None:
        """Finish the bag. Closing again, or after an error of the storage, does nothing.

        Raises:
            BagError: The storage fails; what was synced before stays readable.
        """
        if self._closed:
            return
        try:
            if self._error is None:
                with self._use_file():
                    self._close_file()
                    self._write_metadata()
        finally:
            self._closed = True

    @contextmanager
    def _use_file(self) -> Iterator[None]:
        """Close the file as it is after an error, which every later call raises again."""
        if self._error is not None:
            raise self._error
        if self._closed:
            raise BagError(f'{self.path} must be open for writing; it is closed.')
        try:
            with storage_errors(f'write {self._file_path}'):
                yield
        except BagError as error:
            self._error = error
            atomic_files.close_quietly(self._file)
            raise

    def _is_file_full(self) -> bool:
        return self._files[-1].message_count > 0 and 0 < self._max_bytes <= self._file.tell()

    def _open_file(self) -> None:
        """Create the next file: chunks with CRC, indexes, statistics, summary."""
        self._files.append(FileInfo(f'{self.path.name}_{len(self._files)}.mcap'))
        self._file_path = self.path / self._files[-1].path
        with storage_errors(f'create {self._file_path}'):
            self._file = atomic_files.create_file(self._file_path)
        with self._use_file():
            self._mcap = Writer(
                cast('IO[bytes]', self._file),
                chunk_size=256 * 1024,  # before compression; damage loses a whole chunk
                index_types=IndexType.CHUNK | IndexType.MESSAGE | IndexType.METADATA,
                enable_data_crcs=True,
            )
            self._mcap.start('ros2', f'mlmem_ros {LIBRARY_IDENTIFIER}')
            self._schemas = {}
            self._mcap.add_metadata('mlmem_ros', {'part': str(len(self._files) - 1)})
            for topic in self._topics.values():
                self._declare_channel(topic)
            self._write_metadata()

    def _close_file(self) -> None:
        self._sync_file(self._mcap.finish)
        self._file.close()

    def _sync_file(self, finish: Callable[[], object]) -> None:
        """Finish the open chunk, or the file, and wait until all of it is on the disk."""
        finish()
        self._file.sync_file()
        if self._file.is_deleted:
            raise BagError(f'Cannot write {self._file_path}: it was deleted while being written.')

    def _declare_channel(self, topic: TopicInfo) -> None:
        """Declare the channel of a topic in the file, and its type once for all that share it."""
        if topic.type not in self._schemas:
            text = jazzy.find_definition(topic.type).text
            self._schemas[topic.type] = self._mcap.register_schema(
                topic.type, 'ros2msg', text.encode()
            )
        metadata = {
            'offered_qos_profiles': format_yaml(topic.offered_qos),
            'topic_type_hash': topic.type_hash,
        }
        self._channels[topic.name] = self._mcap.register_channel(
            topic.name, 'cdr', self._schemas[topic.type], metadata
        )

    def _write_metadata(self) -> None:
        path = self.path / 'metadata.yaml'
        with storage_errors(f'write {path}'):
            text = format_metadata(self._topics.values(), self._files)
            atomic_files.write_atomically(path, text)
