# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded bag of a memory node as values: to replay, list and draw."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from operator import attrgetter
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem import Command, End, Refused, Settings, Shot
from mlmem.instrument.instrument import Units
from mlmem.physics import Design
from mlmem.procedure_table import CONTENT_NAMES
from mlmem.schema import short_repr

from ..bag.contents import LOST_KEY, Message
from ..bag.errors import BagError
from ..bag.mcap_part import RECORD_BYTES
from ..bag.reader import BagReader
from ..contract import calls
from ..contract.commands import COMMAND_TOPICS, Make, NoCommand
from ..contract.statuses import Status
from ..contract.streams import SHOT_HEAD_SIZE, STREAMS, Stream, parse_message
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


@dataclass(frozen=True)
class RecordedEcho:
    """An echo and what the node decoded from it.

    Attributes:
        time: When it was received, in seconds from the start of the bag.
        t: Times since the pulse began in time units, shape (n,).
        v_m: Displacement magnitude, shape (n,).
        v_c: Its moving average, shape (n,).
        content: The content published with it by `~/level`, `~/word` or `~/outcome`, or None.
    """

    time: float
    t: Array
    v_m: Array
    v_c: Array
    content: int | None


@dataclass
class SessionData:
    """What a bag holds of one memory node.

    Attributes:
        node: Full name of the node.
        header: Where a replay starts, or None for another recorder's bag.
        stamped: Commands with the tick at which they took effect; empty without a header.
        commands: Messages on the command topics: seconds and the requested command.
        refused: Messages on these topics that are not valid commands: seconds and reason.
        field_time: Seconds of every configuration.
        configuration: Delta_j over time, one array of shape (N,) each.
        strain_time: Seconds of every `end_displacement`.
        end_displacement: Displacement of the substrate's end in metres.
        contents: What the content was, in words: seconds, text, and its keys and values.
        recorded: The values of all event streams, by name: what a replay compares.
        lost: What cannot be read, or was dropped from the recording: one line each.
        missing_parts: Numbers, from 0, of the missing files of a split recording. What follows the
            first gap is not read.
    """

    node: str
    header: Header | None
    stamped: list[tuple[int, Command]] = field(default_factory=list)
    commands: list[tuple[float, Command]] = field(default_factory=list)
    refused: list[tuple[float, str]] = field(default_factory=list)
    hashes: list[StateHash] = field(default_factory=list)
    field_time: list[float] = field(default_factory=list)
    configuration: list[NDArray[np.float32]] = field(default_factory=list)
    strain_time: list[float] = field(default_factory=list)
    end_displacement: list[float] = field(default_factory=list)
    echoes: list[RecordedEcho] = field(default_factory=list)
    shots: list[Shot] = field(default_factory=list)
    contents: list[tuple[float, str, dict[str, str]]] = field(default_factory=list)
    outcomes: list[tuple[float, dict[str, str]]] = field(default_factory=list)
    recorded: dict[str, list[Any]] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)
    missing_parts: tuple[int, ...] = ()

    @property
    def design(self) -> Design:
        """The element, from the header; raises BagError without one."""
        return self.require_header().design

    @property
    def content_name(self) -> str:
        """What the content is called: `word` of a register, else `level`."""
        register = self.header is not None and self.header.settings.register.spacing
        return CONTENT_NAMES[bool(register)]

    @property
    def settings(self) -> Settings:
        """The instrument's settings, from the header; raises as `design` does."""
        return self.require_header().settings

    def require_header(self) -> Header:
        """Return the header; raises BagError without one."""
        if self.header is None:
            raise BagError(
                f'the bag holds no session of {self.node}: another recorder wrote it, '
                'so give design and settings'
            )
        return self.header

    def reads(
        self, end: str = 'left', procedures: Collection[str] = ('read',)
    ) -> list[tuple[RecordedEcho, dict[str, str]]]:
        """Return the last echo of every successful procedure at an end, and its outcome, with a
        delay; a write ends with the echo that verifies it.
        """
        found = []
        for time, values in self.outcomes:
            if values.get('procedure') in procedures and values.get('end') == end:
                before = [echo for echo in self.echoes if echo.time <= time]
                if before and _is_decoded(values) and _has_delay(values):
                    found.append((before[-1], values))
        return found


def _is_decoded(values: Mapping[str, str]) -> bool:
    try:
        calls.parse_content(values)
    except (KeyError, ValueError):
        return False
    return 'error' not in values


def _has_delay(values: Mapping[str, str]) -> bool:
    try:
        return math.isfinite(float(values['delay']))
    except (KeyError, ValueError):  # words have none
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
        BagError: The bag cannot be read, holds no node or several, takes more than
            `MAX_SESSION_BYTES`, or a message is not what its topic requires; the error names the
            message and the fault.
    """
    reader = path if isinstance(path, BagReader) else BagReader(path)
    node = node or _find_only_node(reader)
    session = SessionData(node, None)
    collector = _Collector(session)
    handlers = {f'{node}/{name}': handler for name, handler in collector.list_handlers().items()}
    if not motion:
        for name in ('field', 'joint_states'):
            del handlers[f'{node}/{name}']
    held = 0
    for seconds, message in iterate_timed(reader, node, handlers):
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
    session.lost = [*_list_losses(reader, node), *collector.dropped()]
    return session


Handler = Callable[[float, Any], None]
"""Takes the seconds since the bag began, and a message."""


class _Collector:
    """Sorts messages into a `SessionData`."""

    def __init__(self, session: SessionData) -> None:
        self._session = session
        self._content_is_due = False  # for the last echo
        self._dropped = 0

    def list_handlers(self) -> dict[str, tuple[str, Handler]]:
        """Return the type and the handler of every topic below the node's name."""
        return {
            HEADER_TOPIC: (STRING_TYPE, self._take_header),
            COMMAND_TOPIC: (STRING_TYPE, self._take_stamped),
            STATE_HASH_TOPIC: (STRING_TYPE, self._take_hash),
            DROPPED_TOPIC: ('std_msgs/msg/UInt64', self._count_dropped),
            'field': (STREAMS['field'].type, self._take_field),
            'joint_states': (STREAMS['joint_states'].type, self._take_joint_states),
            **{
                stream.name: (stream.type, self._create_event_handler(stream))
                for stream in STREAMS.values()
                if stream.is_recorded and not stream.is_periodic
            },
            **{
                topic.name: (topic.type, self._create_command_handler(topic.parse))
                for topic in COMMAND_TOPICS
            },
        }

    def dropped(self) -> list[str]:
        """Return what the recorder itself reports missing, in at most one line."""
        lost = f'{self._dropped} messages were dropped from the recording'
        return [lost] if self._dropped else []

    def _take_header(self, _: float, message: Any) -> None:
        self._session.header = self._session.header or read_header(message.data)

    def _take_stamped(self, _: float, message: Any) -> None:
        self._session.stamped.append(read_command(message.data))

    def _take_hash(self, _: float, message: Any) -> None:
        self._session.hashes.append(read_state_hash(message.data))

    def _take_field(self, seconds: float, message: Any) -> None:
        configuration = np.asarray(message.data, dtype=np.float32)
        known = self._session.configuration
        if known and len(known[0]) != len(configuration):
            raise BagError(f'data must have {len(known[0])} cells; got {len(configuration)}')
        self._session.field_time.append(seconds)
        known.append(configuration)

    def _take_joint_states(self, seconds: float, message: Any) -> None:
        self._session.end_displacement.append(calls.parse_displacement(message))
        self._session.strain_time.append(seconds)

    def _take_echo(self, seconds: float, message: Any) -> None:
        t, v_m, v_c = calls.parse_echo(message)
        self._session.echoes.append(RecordedEcho(seconds, t, v_m, v_c, None))
        self._content_is_due = True

    def _take_waveform(self, _: float, message: Any) -> None:
        shot = _parse_shot(np.asarray(message.data, dtype=np.float64), message.layout.data_offset)
        self._session.shots.append(shot)

    def _take_number(self, _: float, content: int) -> None:
        self._set_content(content)

    def _set_content(self, content: int) -> None:
        echoes = self._session.echoes
        if self._content_is_due:
            echoes[-1] = replace(echoes[-1], content=content)
            self._content_is_due = False

    def _take_content(self, seconds: float, content: Status) -> None:
        self._session.contents.append((seconds, content.text, dict(content.values)))

    def _take_outcome(self, seconds: float, outcome: Status) -> None:
        values = dict(outcome.values)
        if _is_decoded(values):  # from the echo just before
            self._set_content(calls.parse_content(values))
        self._session.outcomes.append((seconds, values))
        self._content_is_due = False

    def _count_dropped(self, _: float, message: Any) -> None:
        self._dropped = max(self._dropped, int(message.data))

    def _create_event_handler(self, stream: Stream) -> Handler:
        """Return what keeps the values of a stream for a replay, and takes them further."""
        of_message: dict[str, Handler] = {'echo': self._take_echo, 'waveform': self._take_waveform}
        of_values: dict[str, Handler] = {
            'level': self._take_number,
            'word': self._take_number,
            'content': self._take_content,
            'outcome': self._take_outcome,
        }

        def take_event(seconds: float, message: Any) -> None:
            values = parse_message(stream, message)
            self._session.recorded.setdefault(stream.name, []).append(values)
            if stream.name in of_message:
                of_message[stream.name](seconds, message)
            elif stream.name in of_values:
                of_values[stream.name](seconds, values)

        return take_event

    def _create_command_handler(self, make: Make) -> Handler:
        def take_command(seconds: float, message: Any) -> None:
            header = self._session.header  # the first message of a session
            units = Units(header.design, header.settings.scale) if header else Units()
            try:
                self._session.commands.append((seconds, make(message, units)))
            except NoCommand:
                pass
            except Refused as refusal:  # as the node did
                self._session.refused.append((seconds, str(refusal)))

        return take_command


def _parse_shot(data: Array, offset: int) -> Shot:
    """Return the shot that `streams.encode_shot` gives, `offset` of them before the samples."""
    head, rows = data[:SHOT_HEAD_SIZE], data[SHOT_HEAD_SIZE:]
    if offset != SHOT_HEAD_SIZE or len(rows) < 2 or len(rows) % 2:
        raise ValueError(
            f'data must be {SHOT_HEAD_SIZE} numbers, then 2 rows of samples; got {len(data)} '
            f'numbers, '
            f'{offset} of them before the rows'
        )
    if not np.isfinite(head).all() or np.isinf(rows).any() or min(head[[1, 3, 6]]) <= 0.0:
        raise ValueError(
            'end, carrier, amplitude, sigma, wall, strain, interval and the rests must be finite, '
            f'carrier, sigma and interval above 0; got {short_repr(head)}'
        )
    number, omega_c, A, sigma, wall, strain, dt = map(float, head[:7])
    end = End.RIGHT if number else End.LEFT
    return Shot(end, omega_c, A, sigma, wall, strain, dt, head[7:], rows.reshape(2, -1))


def _list_losses(reader: BagReader, node: str) -> Iterator[str]:
    """Yield what cannot be read of a node, and what an earlier repair could not save."""
    yield from map(str, reader.losses)
    yield from filter(None, reader.custom_data.get(LOST_KEY, '').splitlines())
    missing = []
    counts = reader.metadata.message_counts if reader.metadata else {}
    for topic, count in counts.items():
        read = reader.topics[topic].message_count if topic in reader.topics else 0
        if topic.startswith(f'{node}/') and read < count:
            missing.append(f'~{topic.removeprefix(node)} {count - read} of {count}')
    if missing:
        yield f'messages that metadata.yaml counts: {", ".join(missing)}'


def _find_only_node(reader: BagReader) -> str:
    marks = {HEADER_TOPIC: STRING_TYPE}
    marks |= {topic.name: topic.type for topic in COMMAND_TOPICS}
    found = {
        name.removesuffix(f'/{mark}')
        for name, info in reader.topics.items()
        for mark, kind in marks.items()
        if name.endswith(f'/{mark}') and info.type == kind
    }
    if len(found) == 1:
        return found.pop()
    if found:
        raise BagError(
            f'{reader.path} holds several nodes: name one of {short_repr(sorted(found), 300)}'
        )
    raise BagError(
        f'{reader.path} must hold a memory node: it has none of the topics '
        f'{", ".join(f"~/{mark}" for mark in marks)}; '
        f'got {short_repr(sorted(reader.topics), 300)}'
    )


def iterate_timed(
    reader: BagReader, node: str, topics: Collection[str]
) -> Iterator[tuple[float, Message]]:
    """Yield messages of some topics (full names), each with the seconds since the first of the
    bag.

    A session is read as it was written, tick by tick: log times go back with the clock of a
    simulator that is reset, or that NTP corrects, and the seconds here stand still meanwhile.
    Another recorder does not write in the order of events, so its messages are read by time.
    """
    as_written = f'{node}/{HEADER_TOPIC}' in reader.topics
    start = None if as_written or reader.span is None else reader.span[0]
    latest = 0
    for message in reader.session_messages(topics) if as_written else _sort(reader, topics):
        start = message.log_time if start is None else start - max(0, latest - message.log_time)
        latest = message.log_time
        yield (latest - start) / 1e9, message


def _sort(reader: BagReader, topics: Collection[str]) -> list[Message]:
    """Return messages by log time, those of one time as they were written."""
    found, held = [], 0
    for message in reader.messages(topics):
        held += len(message.cdr) + RECORD_BYTES
        if held > MAX_SESSION_BYTES:
            raise BagError(
                f'{reader.path} must hold no more messages of a node than {MAX_SESSION_BYTES} '
                'bytes of memory',
                'too_large',
            )
        found.append(message)
    return sorted(found, key=attrgetter('log_time'))
