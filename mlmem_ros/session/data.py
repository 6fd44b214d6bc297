# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session of a memory node as values: to replay and list."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

from mlmem import Command, Shot
from mlmem.procedure_table import CONTENT_NAMES
from mlmem.schema import short_repr

from ..bag.contents import Message
from ..bag.errors import BagError
from ..bag.reader import BagReader
from ..contract import answers
from ..contract.streams import SHOT_HEAD_SIZE, STREAMS, decode_shot, parse_message
from .records import (
    Header,
    SessionTopic,
    StateHash,
    name_errors,
    read_command,
    read_header,
    read_state_hash,
)


@dataclass
class SessionData:
    """What a bag holds of one memory node. All times are seconds since the bag began.

    Attributes:
        node: Full name of the node.
        header: Where a replay starts: the first that can be read. Each file of a split recording
            begins with one.
        stamped: Commands with the tick at which they took effect.
        events: The values of all event streams, by name, with their times: what a replay compares.
        dropped: Messages that were dropped from the recording.
        lost: What cannot be read, or was dropped from the recording: one line each.
        missing_parts: Numbers, from 0, of the missing files of a split recording. The session is
            read from the first file that is there up to the next gap.
    """

    node: str
    header: Header
    stamped: list[tuple[int, Command]] = field(default_factory=list)
    hashes: list[StateHash] = field(default_factory=list)
    events: dict[str, list[tuple[float, Any]]] = field(default_factory=dict)
    dropped: int = 0
    lost: list[str] = field(default_factory=list)
    missing_parts: tuple[int, ...] = ()

    @property
    def content_name(self) -> str:
        """What the content is called: `word` of a register, else `level`."""
        return CONTENT_NAMES[self.header.settings.holds_words]

    @property
    def shots(self) -> list[Shot]:
        """The pulses of surveys."""
        found = self.events.get('waveform', [])
        return [decode_shot(values, SHOT_HEAD_SIZE) for _, values in found]

    @property
    def outcomes(self) -> list[tuple[float, Mapping[str, str]]]:
        """How every procedure ended, as the values of `~/outcome`."""
        return [(time, status.values) for time, status in self.events.get('outcome', [])]


def load_session(
    path: str | PathLike[str] | BagReader, node: str = '', max_bytes: int = 2**29
) -> SessionData:
    """Read what a bag, or a reader that opened it, holds of a memory node, by default the only
    one.

    Args:
        max_bytes: Most bytes of messages that the session may hold in memory.

    Raises:
        BagError: The bag cannot be read, holds no session or several or too large a one, or a
            message is not what its topic requires; the error names the message and the fault.
    """
    reader = path if isinstance(path, BagReader) else BagReader(path)
    node = node or find_only_node(reader)
    session = SessionData(node, read_first_header(reader, node))
    types = {topic.value: topic.type for topic in SessionTopic if topic != SessionTopic.HEADER}
    types |= {
        stream.name: stream.type
        for stream in STREAMS.values()
        if stream.is_recorded and not stream.is_periodic
    }
    held = 0
    for seconds, message in iterate_timed(reader, [f'{node}/{name}' for name in types]):
        held += len(message.cdr)
        if held > max_bytes:
            raise BagError(
                f'a session must have at most {max_bytes} bytes of messages; {reader.path} has '
                f'more at {seconds:.3f} s',
                'too_large',
            )
        name = message.topic.removeprefix(f'{node}/')
        with name_errors(f'{message.topic} at {seconds:.3f} s'):
            if message.type != types[name]:
                raise BagError(f'the type must be {types[name]}; got {short_repr(message.type)}')
            _add_message(session, name, seconds, reader.deserialize(message))
    session.missing_parts = reader.missing_parts
    session.lost = list(_list_losses(reader, node))
    if session.dropped:
        session.lost.append(f'{session.dropped} messages were dropped from the recording')
    return session


def read_first_header(reader: BagReader, node: str) -> Header:
    """Return the header of a node's session.

    Raises:
        BagError: The bag has none, or it is invalid.
    """
    topic = f'{node}/{SessionTopic.HEADER}'
    for message in reader.session_messages([topic]):
        with name_errors(topic):
            return read_header(reader.deserialize(message).data)
    raise _describe_missing_session(reader)


def _add_message(session: SessionData, name: str, seconds: float, message: Any) -> None:
    """Add a decoded message to a session, by the name of its topic below the node's."""
    match name:
        case SessionTopic.COMMAND:
            session.stamped.append(read_command(message.data))
        case SessionTopic.STATE_HASH:
            session.hashes.append(read_state_hash(message.data))
        case SessionTopic.DROPPED:
            session.dropped = max(session.dropped, int(message.data))
        case _:
            values = parse_message(STREAMS[name], message)
            if name == 'echo':
                answers.parse_echo(message)  # which refuses what is none
            elif name == 'waveform':
                decode_shot(values, message.layout.data_offset)
            session.events.setdefault(name, []).append((seconds, values))


def _list_losses(reader: BagReader, node: str) -> Iterator[str]:
    """Yield what cannot be read of a node."""
    yield from map(str, reader.losses)
    missing = []
    counts = reader.metadata.message_counts if reader.metadata else {}
    for topic, count in counts.items():
        read = reader.topics[topic].message_count if topic in reader.topics else 0
        if topic.startswith(f'{node}/') and read < count:
            missing.append(f'~{topic.removeprefix(node)} {count - read} of {count}')
    if missing:
        yield f'messages that metadata.yaml counts: {", ".join(missing)}'


def find_only_node(reader: BagReader) -> str:
    """Return the full name of the one memory node of a bag; raise BagError otherwise."""
    found = [
        name.removesuffix(f'/{SessionTopic.HEADER}')
        for name, info in reader.topics.items()
        if name.endswith(f'/{SessionTopic.HEADER}') and info.type == SessionTopic.HEADER.type
    ]
    if len(found) > 1:
        raise BagError(
            f'{reader.path} holds several nodes: name one of {short_repr(sorted(found), 300)}'
        )
    if not found:
        raise _describe_missing_session(reader)
    return found[0]


def _describe_missing_session(reader: BagReader) -> BagError:
    return BagError(
        f'{reader.path} must hold a session of a memory node, as made by `mlmem record`; '
        f'got {short_repr(sorted(reader.topics), 300)}'
    )


def iterate_timed(reader: BagReader, topics: Collection[str]) -> Iterator[tuple[float, Message]]:
    """Yield messages of some topics (full names), each with the seconds since the first of them.

    A session is read as it was written, tick by tick: log times go back with the clock of a
    simulator that is reset, or that NTP corrects, and the seconds here stand still meanwhile.
    """
    start, latest = None, 0
    for message in reader.session_messages(topics):
        start = message.log_time if start is None else start - max(0, latest - message.log_time)
        latest = message.log_time
        yield (latest - start) / 1e9, message
