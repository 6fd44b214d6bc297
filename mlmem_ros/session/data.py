# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session of a memory node as values: to replay, list and draw."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem import Command, Shot
from mlmem.procedure_table import CONTENT_NAMES
from mlmem.schema import short_repr

from ..bag.contents import Message
from ..bag.errors import BagError
from ..bag.reader import BagReader
from ..contract import answers
from ..contract.streams import SHOT_HEAD_SIZE, STREAMS, Stream, decode_shot, parse_message
from ..contract.topics import Status
from .records import (
    COMMAND_TOPIC,
    DROPPED_TOPIC,
    HEADER_TOPIC,
    STATE_HASH_TOPIC,
    STRING_TYPE,
    Header,
    StateHash,
    name_errors,
    read_command,
    read_header,
    read_state_hash,
)

Array = NDArray[np.float64]


@dataclass
class SessionData:
    """What a bag holds of one memory node. All times are seconds since the bag began.

    Attributes:
        node: Full name of the node.
        header: Where a replay starts.
        stamped: Commands with the tick at which they took effect.
        events: The values of all event streams, by name, with their times: what a replay compares.
        configurations: Delta_j over time, one array of shape (N,) each.
        displacements: Displacement of the substrate's end in metres over time.
        lost: What cannot be read, or was dropped from the recording: one line each.
        missing_parts: Numbers, from 0, of the missing files of a split recording. What follows the
            first gap is not read.
    """

    node: str
    header: Header
    stamped: list[tuple[int, Command]] = field(default_factory=list)
    hashes: list[StateHash] = field(default_factory=list)
    events: dict[str, list[tuple[float, Any]]] = field(default_factory=dict)
    configurations: list[tuple[float, NDArray[np.float32]]] = field(default_factory=list)
    displacements: list[tuple[float, float]] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    missing_parts: tuple[int, ...] = ()

    @property
    def content_name(self) -> str:
        """What the content is called: `word` of a register, else `level`."""
        return CONTENT_NAMES[bool(self.header.settings.register.spacing)]

    @property
    def echoes(self) -> list[tuple[float, Array]]:
        """Rows t, v_m and v_c of every echo, shape (3, n), with its time."""
        return [
            (time, values.reshape(3, -1).astype(np.float64))
            for time, values in self.events.get('echo', [])
        ]

    @property
    def shots(self) -> list[Shot]:
        """The pulses of surveys."""
        found = self.events.get('waveform', [])
        return [decode_shot(values, SHOT_HEAD_SIZE) for _, values in found]

    @property
    def outcomes(self) -> list[tuple[float, Mapping[str, str]]]:
        """How every procedure ended, as the values of `~/outcome`."""
        return [(time, status.values) for time, status in self.events.get('outcome', [])]

    @property
    def contents(self) -> list[tuple[float, Status]]:
        """What the content was, in words, as `~/content` said."""
        return self.events.get('content', [])

    def reads(
        self, end: str = 'left', procedures: Collection[str] = ('read',)
    ) -> list[tuple[Array, Mapping[str, str]]]:
        """Return the last echo of every successful procedure at an end, and its outcome, with a
        delay; a write ends with the echo that verifies it.
        """
        found, echoes = [], self.echoes
        for time, values in self.outcomes:
            if values.get('procedure') in procedures and values.get('end') == end:
                before = [rows for heard, rows in echoes if heard <= time]
                if before and _has_content_and_delay(values):
                    found.append((before[-1], values))
        return found


def _has_content_and_delay(values: Mapping[str, str]) -> bool:
    try:
        answers.parse_content(values)
        return 'error' not in values and math.isfinite(float(values['delay']))
    except (KeyError, ValueError):  # words have no delay
        return False


MAX_SESSION_BYTES = 2**29
"""Most bytes of messages that a loaded session holds."""


def load_session(
    path: str | PathLike[str] | BagReader, node: str = '', motion: bool = True
) -> SessionData:
    """Read what a bag, or a reader that opened it, holds of a memory node, by default the only
    one.

    Args:
        motion: Whether to read configurations and displacements, which only a picture needs.

    Raises:
        BagError: The bag cannot be read, holds no session or several, takes more than
            `MAX_SESSION_BYTES`, or a message is not what its topic requires; the error names the
            message and the fault.
    """
    reader = path if isinstance(path, BagReader) else BagReader(path)
    node = node or find_only_node(reader)
    session = SessionData(node, read_first_header(reader, node))
    dropped: list[int] = []
    handlers = _list_handlers(session, dropped, motion)
    held = 0
    for seconds, message in iterate_timed(reader, handlers):
        held += len(message.cdr)
        if held > MAX_SESSION_BYTES:
            raise BagError(
                f'a session must have at most {MAX_SESSION_BYTES} bytes of messages; '
                f'{reader.path} has more at {seconds:.3f} s',
                'too_large',
            )
        kind, handler = handlers[message.topic]
        with name_errors(f'{message.topic} at {seconds:.3f} s'):
            if message.type != kind:
                raise BagError(f'the type must be {kind}; got {short_repr(message.type)}')
            handler(seconds, reader.deserialize(message))
    session.missing_parts = reader.missing_parts
    session.lost = list(_list_losses(reader, node))
    if dropped:
        session.lost.append(f'{max(dropped)} messages were dropped from the recording')
    return session


def read_first_header(reader: BagReader, node: str) -> Header:
    """Return the header of a node's session.

    Raises:
        BagError: The bag has none, or it is invalid.
    """
    topic = f'{node}/{HEADER_TOPIC}'
    for message in reader.session_messages([topic]):
        with name_errors(topic):
            return read_header(reader.deserialize(message).data)
    raise _describe_missing_session(reader)


Handler = Callable[[float, Any], object]
"""Takes the seconds since the bag began, and a message."""


def _list_handlers(
    session: SessionData, dropped: list[int], motion: bool
) -> dict[str, tuple[str, Handler]]:
    """Return what takes the messages of every topic into a session, with its type."""
    commands, hashes = session.stamped, session.hashes
    handlers: dict[str, tuple[str, Handler]] = {
        COMMAND_TOPIC: (STRING_TYPE, lambda _, each: commands.append(read_command(each.data))),
        STATE_HASH_TOPIC: (STRING_TYPE, lambda _, each: hashes.append(read_state_hash(each.data))),
        DROPPED_TOPIC: ('std_msgs/msg/UInt64', lambda _, each: dropped.append(int(each.data))),
    }
    handlers |= {
        stream.name: (stream.type, partial(_take_event, session, stream))
        for stream in STREAMS.values()
        if stream.is_recorded and not stream.is_periodic
    }
    if motion:
        handlers |= {
            name: (STREAMS[name].type, partial(take, session))
            for name, take in (('field', _take_field), ('joint_states', _take_joint_states))
        }
    return {f'{session.node}/{name}': each for name, each in handlers.items()}


def _take_event(session: SessionData, stream: Stream, seconds: float, message: Any) -> None:
    values = parse_message(stream, message)
    if stream.name == 'echo':
        answers.parse_echo(message)  # which refuses what is none
    elif stream.name == 'waveform':
        decode_shot(values, message.layout.data_offset)
    session.events.setdefault(stream.name, []).append((seconds, values))


def _take_field(session: SessionData, seconds: float, message: Any) -> None:
    configuration = np.asarray(message.data, dtype=np.float32)
    if len(configuration) != session.header.design.N:
        raise BagError(f'data must have {session.header.design.N} cells; got {len(configuration)}')
    session.configurations.append((seconds, configuration))


def _take_joint_states(session: SessionData, seconds: float, message: Any) -> None:
    session.displacements.append((seconds, answers.parse_displacement(message)))


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
        name.removesuffix(f'/{HEADER_TOPIC}')
        for name, info in reader.topics.items()
        if name.endswith(f'/{HEADER_TOPIC}') and info.type == STRING_TYPE
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
