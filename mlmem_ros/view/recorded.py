# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session for a page: its public topics, thinned out to a bounded size."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bag.errors import BagError
from ..bag.reader import BagReader
from ..clipped import clipped
from ..contract import told, topics
from ..physics import DesignError
from ..session.messages import COMMAND, HEADER
from .echoes import thinned
from .element import Element
from .frames import counts, packed

COLUMNS = 12_000
"""Most configurations shown; of a longer session every second, fourth ... one."""

EVENTS = 5000
"""Most commands, outcomes and echoes shown, of each kind."""


@dataclass(frozen=True)
class Recorded:
    """A session as a page shows it.

    Attributes:
        name: Its name.
        element: The element.
        parameters: The node's parameters.
        events: Commands and outcomes in order: t, kind, text.
        lost: What could not be read.
        frame: Everything a page needs, as a frame.
    """

    name: str
    element: Element
    parameters: Mapping[str, Any]
    events: list[dict[str, Any]]
    lost: list[str]
    frame: bytes


class Columns:
    """Times and rows of numbers; if there are too many, every second one is dropped."""

    def __init__(self) -> None:
        self.t: list[float] = []
        self.rows: list[Any] = []
        self._every = 1
        self._count = 0

    def add(self, t: float, row: Any) -> None:
        """Add a row, if it is its turn."""
        if self._count % self._every == 0:
            self.t.append(t)
            self.rows.append(row)
            if len(self.t) > COLUMNS:
                del self.t[1::2], self.rows[1::2]
                self._every *= 2
        self._count += 1


def load(path: str | Path) -> Recorded:
    """Read a session.

    Raises:
        BagError: It cannot be read, or holds no session.
    """
    reader = BagReader(path)
    node, header = _header(reader)
    parameters = _mapping(header, 'parameters')
    try:
        element = Element.of(_flat(header) | parameters, node)
    except (DesignError, TypeError, ValueError) as error:
        raise BagError(f'{path}: the session does not describe an element; {error}') from error
    collector = _Collector(element, reader)
    begin = reader.span[0] if reader.span else 0
    collector.take(begin)
    name = Path(path).resolve().name
    frame = collector.frame(
        {
            'name': name,
            'element': element.about,
            'delays': _delays(header),
            'lost': list(map(str, reader.losses)),
            'duration': ((reader.span[1] - begin) / 1e9) if reader.span else 0.0,
        }
    )
    lost = list(map(str, reader.losses))
    return Recorded(name, element, parameters, collector.events, lost, frame)


def _header(reader: BagReader) -> tuple[str, dict[str, Any]]:
    """Return the node of a session, and its first record."""
    names = [name for name in reader.topics if name.endswith(f'/{HEADER}')]
    for message in reader.messages(names):
        text = reader.deserialize(message).data
        try:
            header = json.loads(text)
        except ValueError as error:
            raise BagError(f'{message.topic}: {error}') from error
        if isinstance(header, dict):
            return message.topic.removesuffix(f'/{HEADER}'), header
    raise BagError(
        f'{reader.path} must hold a session of a memory node, as made by `mlmem record`; '
        f'got {clipped(sorted(reader.topics), 300)}'
    )


def _mapping(values: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = values.get(name)
    return found if isinstance(found, dict) else {}


def _flat(header: Mapping[str, Any]) -> dict[str, Any]:
    """Return design and settings by the names of the parameters."""
    flat = {f'design.{name}': value for name, value in _mapping(header, 'design').items()}
    for group, values in _mapping(header, 'settings').items():
        if isinstance(values, dict):
            flat |= {f'{group}.{name}': value for name, value in values.items()}
    return flat


def _delays(header: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return the echo delay of every level by end, at the session's start."""
    tables = _mapping(_mapping(header, 'initial'), 'calibration')
    return {
        end: [float(delay) for delay in table['delays']]
        for end, table in tables.items()
        if isinstance(table, dict) and isinstance(table.get('delays'), list)
    }


class _Collector:
    """Sorts messages into what a page draws."""

    def __init__(self, element: Element, reader: BagReader) -> None:
        self._element = element
        self._reader = reader
        self._fields, self._strains, self._walls = Columns(), Columns(), Columns()
        self._levels: list[tuple[float, int]] = []
        self._echoes: list[tuple[float, NDArray[np.float32]]] = []
        self.events: list[dict[str, Any]] = []

    def take(self, begin: int) -> None:
        """Take all messages; `begin` is the time of the first one in nanoseconds."""
        node = self._element.about['node']
        takers = {
            topics.FIELD.name: self._field,
            topics.JOINT_STATES.name: self._joints,
            topics.WALL.name: self._wall,
            topics.LEVEL.name: self._level,
            topics.ECHO.name: self._echo,
            topics.OUTCOME.name: self._outcome,
            COMMAND: self._command,
        }
        takers = {f'{node}/{name}': take for name, take in takers.items()}
        for message in self._reader.messages(takers):
            seconds = (message.log_time - begin) / 1e9
            try:
                takers[message.topic](seconds, self._reader.deserialize(message))
            except (AttributeError, LookupError, TypeError, ValueError) as error:
                raise BagError(f'{message.topic} at {seconds:.3f} s: {error}') from error

    def frame(self, head: dict[str, Any]) -> bytes:
        """Return all of it, with its own header."""
        echoes = self._echoes
        head |= {
            'k': 'session',
            't': self._fields.t,
            'strain': [self._strains.t, self._strains.rows],
            'walls': [self._walls.t, self._walls.rows],
            'levels': self._levels,
            'events': self.events,
            'echoes': [
                {'t': t, 'x': np.round(data[0], 2).tolist(), 'y': data[1].tolist()}
                for t, data in echoes
            ],
        }
        rows = self._element.about['rows']
        body = np.stack(self._fields.rows) if self._fields.rows else np.zeros((0, rows), 'i2')
        return packed(head, body)

    def _field(self, t: float, message: Any) -> None:
        data = np.asarray(message.data)[:: self._element.stride]
        if len(data) != self._element.about['rows']:
            raise ValueError(f'data must have {self._element.design.N} cells')
        self._fields.add(t, counts(data, self._element.phases))

    def _joints(self, t: float, message: Any) -> None:
        self._strains.add(t, round(told.displacement(message) / self._element.length, 6))

    def _wall(self, t: float, message: Any) -> None:
        self._walls.add(t, [round(float(site), 3) for site in message.data])

    def _level(self, t: float, message: Any) -> None:
        if len(self._levels) < EVENTS:
            self._levels.append((t, int(message.data)))

    def _echo(self, t: float, message: Any) -> None:
        self._echoes.append((t, thinned(message)))
        if len(self._echoes) > EVENTS // 10:
            del self._echoes[1::2]

    def _outcome(self, t: float, message: Any) -> None:
        good = int(message.level[0] if isinstance(message.level, bytes) else message.level) == 0
        values = told.values(message)
        text = str(message.message)
        if not good:
            text = f'{values.get("procedure", "it")} failed: {text}'
        self._event(t, 'outcome', text, ok=good, values=values)

    def _command(self, t: float, message: Any) -> None:
        given = json.loads(message.data)
        kind = str(given.get('kind', ''))
        self._event(t, 'command', ' '.join(_words(kind, given)), tick=int(given.get('tick', 0)))

    def _event(self, t: float, kind: str, text: str, **more: Any) -> None:
        if len(self.events) < EVENTS:
            self.events.append({'t': round(t, 4), 'kind': kind, 'text': text, **more})


def _words(kind: str, given: Mapping[str, Any]) -> Iterator[str]:
    """Describe a command in words."""
    yield {
        'SetStrain': 'strain',
        'FollowTrajectory': 'follow',
        'SelfTest': 'self_test',
        'SetFaults': 'faults',
    }.get(kind, kind.lower())
    match kind:
        case 'Write':
            yield str(given.get('level'))
        case 'SetStrain':
            yield f'{given.get("strain", 0.0):+.4f}'
        case 'FollowTrajectory':
            strains = given.get('strains') or [0.0]
            yield f'to {strains[-1]:+.4f}'
        case 'Read' if given.get('end'):
            yield f'from the {given["end"]}'
        case 'SetFaults':
            faults = _mapping(given, 'faults')
            yield ', '.join(name for name, value in faults.items() if _is_set(name, value))


def _is_set(name: str, value: Any) -> bool:
    return (
        bool(value)
        and name not in ('seed', 'weak_factor')
        and not (name == 'damping_factor' and value == 1.0)
    )
