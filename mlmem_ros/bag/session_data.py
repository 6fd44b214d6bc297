# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session as arrays: what is drawn, listed and decoded again."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics import Design
from .errors import BagError
from .reader import BagReader
from .session import HEADER

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RecordedEcho:
    """An echo and what was decoded from it.

    Attributes:
        time: When it was heard, in seconds from the start of the session.
        t: Times since the pulse began in time units, shape (n,).
        v_m: Displacement magnitude, shape (n,).
        v_c: Its moving average, shape (n,).
        level: The level decoded from it at the time.
    """

    time: float
    t: Array
    v_m: Array
    v_c: Array
    level: int


@dataclass(frozen=True)
class SessionData:
    """A session of one node.

    Attributes:
        node: Full name of the node.
        header: All a replay starts from.
        design: The element.
        start: Log time of the first message in nanoseconds.
        field_time: Seconds of every configuration, shape (m,).
        configuration: Delta_j over time, shape (m, N).
        strain_time: Seconds of every strain sample, shape (k,).
        strain: Substrate strain, shape (k,).
        echoes: Every probe, in order.
        outcomes: How every procedure ended: seconds, and its keys and values.
    """

    node: str
    header: dict[str, Any]
    design: Design
    start: int
    field_time: Array
    configuration: Array
    strain_time: Array
    strain: Array
    echoes: list[RecordedEcho] = field(default_factory=list)
    outcomes: list[tuple[float, dict[str, str]]] = field(default_factory=list)

    def read_echoes(self) -> list[tuple[RecordedEcho, dict[str, str]]]:
        """Return the echoes that reads from the left ended with, each with its outcome."""
        found = []
        for time, values in self.outcomes:
            if values.get('procedure') == 'read' and values.get('end') == 'left':
                before = [echo for echo in self.echoes if echo.time <= time]
                if before:
                    found.append((before[-1], values))
        return found


def load(path: str | PathLike[str]) -> SessionData:
    """Read a session bag.

    Args:
        path: The bag.

    Raises:
        BagError: It cannot be read, or holds no session of a memory node.
    """
    reader = BagReader(path)
    node, header = _header(reader)
    design = Design(**header['design'])
    length = float(header['settings']['scale']['length'])
    start = reader.span[0] if reader.span else 0
    times: dict[str, list[float]] = {'field': [], 'joint_states': []}
    configurations: list[Array] = []
    strains: list[float] = []
    echoes: list[RecordedEcho] = []
    outcomes: list[tuple[float, dict[str, str]]] = []
    waiting: Any = None
    names = {f'{node}/{name}': name for name in (*times, 'echo', 'level', 'outcome')}
    for message in reader.messages(names):
        name, seconds = names[message.topic], (message.log_time - start) / 1e9
        content = reader.deserialize(message)
        if name in times:
            times[name].append(seconds)
        if name == 'field':
            configurations.append(np.asarray(content.data, dtype=np.float32))
        elif name == 'joint_states':
            strains.append(float(content.position[0]) / length / design.N)
        elif name == 'echo':
            waiting = np.asarray(content.data, dtype=np.float64).reshape(3, -1)
        elif name == 'level' and waiting is not None:
            echoes.append(RecordedEcho(seconds, *waiting, int(content.data)))
            waiting = None
        elif name == 'outcome':
            outcomes.append((seconds, {item.key: item.value for item in content.values}))
    return SessionData(
        node,
        header,
        design,
        start,
        np.array(times['field']),
        np.array(configurations).reshape(-1, design.N),
        np.array(times['joint_states']),
        np.array(strains),
        echoes,
        outcomes,
    )


def _header(reader: BagReader) -> tuple[str, dict[str, Any]]:
    topics = [name for name in reader.topics if name.endswith(f'/{HEADER}')]
    for message in reader.messages(topics):
        header = json.loads(reader.deserialize(message).data)
        return str(header['node']), header
    raise BagError(
        f'{reader.path} must be a session of a memory node: it has no topic '
        f'<node>/{HEADER} with a message; got topics {", ".join(sorted(reader.topics)) or "none"}.'
    )
