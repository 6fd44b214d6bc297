# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session for a page: its public topics, thinned out to a bounded size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mlmem import Disturb, End, Write
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract.topics import OK, parse_status
from mlmem_ros.session.data import find_only_node, iterate_timed, read_first_header
from mlmem_ros.session.records import SessionTopic, name_errors, read_command

from ..describe_command import describe_command
from .about import About
from .frames import PICTURED_STREAMS, pack_frame, read_walls, thin_echo


class Columns:
    """Times and rows of numbers, at most so many; of more every second, fourth ... one."""

    def __init__(self, max_count: int = 12_000) -> None:
        self._max_count = max_count
        self.t: list[float] = []
        self.rows: list[Any] = []
        self._every = 1
        self._count = 0

    def add(self, t: float, row: Any) -> None:
        """Add a row, if it is its turn."""
        if self._count % self._every == 0:
            self.t.append(t)
            self.rows.append(row)
            if len(self.t) > self._max_count:
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
    about, known = About(header.design, header.settings, node), header.calibration
    fields, strains, walls = Columns(), Columns(), Columns()
    levels: list[tuple[float, int]] = []
    echoes: list[dict[str, Any]] = []
    events: list[dict[str, Any]] = []
    names = {
        f'{node}/{name}': name
        for name in (
            *PICTURED_STREAMS, 'level', 'word', 'echo', 'content', 'outcome', SessionTopic.COMMAND,
        )
    }  # fmt: skip
    max_events = 5000  # most commands, outcomes and levels shown, of each kind
    t = 0.0
    for t, recorded in iterate_timed(reader, names):
        with name_errors(f'{recorded.topic} at {t:.3f} s'):
            message = reader.deserialize(recorded)
            match names[recorded.topic]:
                case 'field':
                    fields.add(t, about.scale_field(message))
                case 'joint_states':
                    strains.add(t, about.read_strain(message))
                case 'wall':
                    walls.add(t, read_walls(message))
                case 'level' | 'word':
                    levels.append((t, int(message.data)))
                case 'echo':
                    x, y = thin_echo(message)
                    echoes.append({'t': t, 'x': np.round(x, 2).tolist(), 'y': y.tolist()})
                    if len(echoes) > max_events // 10:
                        del echoes[1::2]
                case name:
                    if event := _describe_event(name, message, about):
                        events.append({'t': round(t, 4), **event})
    head = {
        'k': 'session',
        'name': Path(path).resolve().name,
        'element': about.json,
        'delays': {end: known.table(end).delays for end in End},
        'lost': list(map(str, reader.losses)),
        'duration': t,
        't': fields.t,
        'strain': [strains.t, strains.rows],
        'walls': [walls.t, walls.rows],
        'levels': levels[:max_events],
        'events': events[:max_events],
        'echoes': echoes,
    }
    return pack_frame(head, np.stack(fields.rows) if fields.rows else None)


def _describe_event(name: str, message: Any, about: About) -> dict[str, Any] | None:
    """Return a command, an outcome, or a content that is no longer known, in words."""
    if name == SessionTopic.COMMAND:
        _, command = read_command(message.data)
        if isinstance(command, Disturb):  # there are too many
            return None
        written = {'content': command.level} if isinstance(command, Write) else {}
        text = describe_command(command, 'word' if about.json['code'] else 'level')
        return {'kind': 'command', 'text': text, **written}
    severity, text, values = parse_status(message)
    if name == 'content':
        lost = {'kind': name, 'text': text, 'ok': False, 'values': values}
        return lost if 'since' in values else None
    if severity != OK:
        text = f'{values["procedure"]} failed: {text}'
    return {'kind': name, 'text': text, 'ok': severity == OK, 'values': values}
