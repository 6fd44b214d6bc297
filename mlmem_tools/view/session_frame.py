# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session for a page: its public topics, thinned out to a bounded size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mlmem import Disturb, Write
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract import calls
from mlmem_ros.contract.topics import OK, parse_status
from mlmem_ros.session.data import find_only_node, iterate_timed, read_first_header
from mlmem_ros.session.records import COMMAND_TOPIC, name_errors, read_command

from ..describe_command import describe_command
from .about import About
from .frames import pack_frame, scale_configuration, thin_echo

MAX_COLUMNS = 12_000
"""Most configurations shown; of a longer session every second, fourth ... one."""

MAX_EVENTS = 5000
"""Most commands, outcomes and echoes shown, of each kind."""


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


def load_frame(path: str | Path) -> bytes:
    """Return a session as a frame.

    Raises:
        BagError: It cannot be read, or holds no session.
    """
    reader = BagReader(path)
    node = find_only_node(reader)
    header = read_first_header(reader, node)
    about, known = About.of(header.design, header.settings, node), header.calibration
    collector = _Collector(about)
    collector.take_messages(reader)
    head = {
        'k': 'session',
        'name': Path(path).resolve().name,
        'element': about.json,
        'delays': {end: known.table(end).delays for end in known.ends},
        'lost': list(map(str, reader.losses)),
        'duration': collector.duration,
    }
    return collector.build_frame(head)


class _Collector:
    """Sorts messages into what a page draws."""

    def __init__(self, about: About) -> None:
        self._about = about
        self._content_name = 'word' if about.json['code'] else 'level'
        self._fields, self._strains, self._walls = Columns(), Columns(), Columns()
        self._levels: list[tuple[float, int | str]] = []
        self._echoes: list[dict[str, Any]] = []
        self.events: list[dict[str, Any]] = []
        self.duration = 0.0

    def take_messages(self, reader: BagReader) -> None:
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
        for seconds, message in iterate_timed(reader, takers):
            self.duration = seconds
            with name_errors(f'{message.topic} at {seconds:.3f} s'):
                takers[message.topic](seconds, reader.deserialize(message))

    def build_frame(self, head: dict[str, Any]) -> bytes:
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
            written = {'content': command.level} if isinstance(command, Write) else {}
            text = describe_command(command, self._content_name)
            self._add_event(t, 'command', text, **written)

    def _add_event(self, t: float, kind: str, text: str, **more: Any) -> None:
        if len(self.events) < MAX_EVENTS:
            self.events.append({'t': round(t, 4), 'kind': kind, 'text': text, **more})
