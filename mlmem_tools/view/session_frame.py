# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session for a page: its public topics, thinned out to a bounded size; and how two
differ.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from mlmem import (
    Command,
    Disturb,
    FollowTrajectory,
    Read,
    SetFaults,
    SetMethod,
    SetStrain,
    Write,
)
from mlmem.procedure_table import CONTENT_NAMES, describe_content
from mlmem.schema import short_repr
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract import calls
from mlmem_ros.contract.commands import REQUEST_COMMANDS
from mlmem_ros.contract.statuses import OK, parse_status
from mlmem_ros.session.data import iterate_timed
from mlmem_ros.session.records import (
    COMMAND_TOPIC,
    HEADER_TOPIC,
    Header,
    name_errors,
    read_command,
    read_header,
)

from .about import About
from .frames import pack_frame, scale_configuration, thin_echo

MAX_COLUMNS = 12_000
"""Most configurations shown; of a longer session every second, fourth ... one."""

MAX_EVENTS = 5000
"""Most commands, outcomes and echoes shown, of each kind."""

COMMAND_NAMES: dict[type[Any], str] = {
    **{kind: name for name, kind in REQUEST_COMMANDS.items()},
    SetStrain: 'strain',
    SetFaults: 'faults',
    SetMethod: 'write.method',
}


@dataclass(frozen=True)
class SessionFrame:
    """A session as a page shows it.

    Attributes:
        parameters: What a replay depends on, by name: design, settings, versions.
        events: Commands and outcomes in order: t, kind, text.
        frame: Everything a page needs, as a frame.
    """

    parameters: Mapping[str, Any]
    events: list[dict[str, Any]]
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
            if len(self.t) > MAX_COLUMNS:
                del self.t[1::2], self.rows[1::2]
                self._every *= 2
        self._count += 1


def load_frame(path: str | Path) -> SessionFrame:
    """Read a session.

    Raises:
        BagError: It cannot be read, or holds no session.
    """
    reader = BagReader(path)
    node, header = _read_first_header(reader)
    groups = {'design': header.design.as_dict(), **header.settings.as_dict()}
    about, known = About.of(header.design, header.settings, node), header.calibration
    collector = _Collector(about)
    collector.take(reader)
    head = {
        'k': 'session',
        'name': Path(path).resolve().name,
        'element': about.json,
        'delays': {end: known.table(end).delays for end in known.ends},
        'lost': list(map(str, reader.losses)),
        'duration': collector.duration,
    }
    parameters = {
        f'{group}.{name}': value
        for group, values in {**groups, 'versions': header.versions}.items()
        for name, value in values.items()
    }
    return SessionFrame(parameters, collector.events, collector.frame(head))


def _read_first_header(reader: BagReader) -> tuple[str, Header]:
    names = [name for name in reader.topics if name.endswith(f'/{HEADER_TOPIC}')]
    for message in reader.messages(names):
        with name_errors(message.topic):
            header = read_header(reader.deserialize(message).data)
        return message.topic.removesuffix(f'/{HEADER_TOPIC}'), header
    raise BagError(
        f'{reader.path} must hold a session of a memory node, as made by `mlmem record`; '
        f'got {short_repr(sorted(reader.topics), 300)}'
    )


class _Collector:
    """Sorts messages into what a page draws."""

    def __init__(self, about: About) -> None:
        self._about = about
        self._fields, self._strains, self._walls = Columns(), Columns(), Columns()
        self._levels: list[tuple[float, int | str]] = []
        self._echoes: list[dict[str, Any]] = []
        self.events: list[dict[str, Any]] = []
        self.duration = 0.0

    def take(self, reader: BagReader) -> None:
        """Take all messages."""
        takers = {
            'field': self._take_field,
            'joint_states': self._take_joints,
            'wall': self._take_wall,
            'level': self._take_content_number,
            'word': self._take_content_number,
            'content': self._take_content,
            'echo': self._take_echo,
            'outcome': self._take_outcome,
            COMMAND_TOPIC: self._take_command,
        }
        node = self._about.json['node']
        takers = {f'{node}/{name}': take for name, take in takers.items()}
        for seconds, message in iterate_timed(reader, node, takers):
            self.duration = seconds
            with name_errors(f'{message.topic} at {seconds:.3f} s'):
                takers[message.topic](seconds, reader.deserialize(message))

    def frame(self, head: dict[str, Any]) -> bytes:
        """Return all of it, with the rest of its header."""
        head |= {
            't': self._fields.t,
            'strain': [self._strains.t, self._strains.rows],
            'walls': [self._walls.t, self._walls.rows],
            'levels': self._levels,
            'events': self.events,
            'echoes': self._echoes,
        }
        return pack_frame(head, np.stack(self._fields.rows) if self._fields.rows else None)

    def _take_field(self, t: float, message: Any) -> None:
        if len(message.data) != self._about.design.N:
            raise ValueError(f'data must have {self._about.design.N} cells')
        data = np.asarray(message.data)[:: self._about.stride]
        self._fields.add(t, scale_configuration(data, self._about.phases))

    def _take_joints(self, t: float, message: Any) -> None:
        self._strains.add(t, round(calls.parse_displacement(message) / self._about.length, 6))

    def _take_wall(self, t: float, message: Any) -> None:
        self._walls.add(t, [round(float(site), 3) for site in message.data])

    def _take_content_number(self, t: float, message: Any) -> None:
        if len(self._levels) < MAX_EVENTS:
            self._levels.append((t, int(message.data)))

    def _take_content(self, t: float, message: Any) -> None:
        _, text, values = parse_status(message)
        if 'since' in values:
            self._add_event(t, 'content', text, ok=False, values=values)

    def _take_echo(self, t: float, message: Any) -> None:
        x, y = thin_echo(message)
        self._echoes.append({'t': t, 'x': np.round(x, 2).tolist(), 'y': y.tolist()})
        if len(self._echoes) > MAX_EVENTS // 10:
            del self._echoes[1::2]

    def _take_outcome(self, t: float, message: Any) -> None:
        severity, text, values = parse_status(message)
        if severity != OK:
            text = f'{values["procedure"]} failed: {text}'
        self._add_event(t, 'outcome', text, ok=severity == OK, values=values)

    def _take_command(self, t: float, message: Any) -> None:
        _, command = read_command(message.data)
        if not isinstance(command, Disturb):  # there are too many
            text, more = _describe_command(command), {}
            if isinstance(command, Write):
                more['content'] = command.level
                if self._about.json['code']:
                    text = f'write {describe_content("word", command.level)}'
            self._add_event(t, 'command', text, **more)

    def _add_event(self, t: float, kind: str, text: str, **more: Any) -> None:
        if len(self.events) < MAX_EVENTS:
            self.events.append({'t': round(t, 4), 'kind': kind, 'text': text, **more})


def _describe_command(command: Command) -> str:
    name = COMMAND_NAMES[type(command)]
    match command:
        case Write(level=level):
            return f'{name} {level}'
        case SetStrain(strain=strain):
            return f'{name} {strain:+.4f}'
        case FollowTrajectory(strains=strains):
            return f'{name} to {strains[-1]:+.4f}'
        case Read(end=end) if end:
            return f'{name} from {end}'
        case SetFaults(faults=faults):
            return f'{name} {", ".join(faults.list_active()) or "healed"}'
        case SetMethod(method=method):
            return f'{name} {method}'
        case _:
            return name


MAX_LISTED_LINES = 200
"""Lines shown of each kind."""


def compare_sessions(left: SessionFrame, right: SessionFrame) -> dict[str, Any]:
    """Return how two sessions differ.

    Returns:
        `parameters`: name, value left, value right. `events`: those without a counterpart, in
        order; pairs of one of either side, or None. `alike`: how many events agree. `more`: how
        many lines beyond `MAX_LISTED_LINES` of either kind are left out.
    """
    names = sorted({*left.parameters, *right.parameters})
    values = ([name, left.parameters.get(name), right.parameters.get(name)] for name in names)
    parameters = [each for each in values if each[1] != each[2]]
    events: list[tuple[Any, Any]] = []
    alike = 0
    a, b = ([_format_event(event) for event in each.events] for each in (left, right))
    matcher = SequenceMatcher(a=a, b=b, autojunk=False)
    for tag, i, j, k, end in matcher.get_opcodes():
        if tag == 'equal':
            alike += j - i
        else:
            events += zip_longest(
                map(_shorten_event, left.events[i:j]), map(_shorten_event, right.events[k:end])
            )
    return {
        'parameters': parameters[:MAX_LISTED_LINES],
        'events': events[:MAX_LISTED_LINES],
        'alike': alike,
        'more': sum(max(0, len(each) - MAX_LISTED_LINES) for each in (parameters, events)),
    }


def _format_event(event: dict[str, Any]) -> str:
    """Return the part of an event that must agree: not its time or its delay."""
    values = event.get('values', {})
    kept = [values[key] for key in (*CONTENT_NAMES, 'attempts') if key in values]
    return ' '.join([event['kind'], event['text'], *kept])


def _shorten_event(event: dict[str, Any]) -> dict[str, Any]:
    values, text = event.get('values', {}), event['text']
    for name in CONTENT_NAMES:
        if name in values:
            text = f'{text}, {describe_content(name, int(values[name]))}'
    return {'t': event['t'], 'kind': event['kind'], 'text': text}
