# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The streams of a memory node: all that it publishes below its name, each described once.

Publishing, recording, a replay's comparison, the reference page and the SROS2 policy follow from
`STREAMS`. A stream gives values without ROS; the node's `Publishers` make the message of its type
of them, and `parse_message` returns them from a recorded one.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np

from mlmem import (
    UNDECODABLE,
    Array,
    EchoReceived,
    End,
    Event,
    MemoryElement,
    Outcome,
    Shot,
    Unknown,
)
from mlmem.procedure_table import JOINT_NAME
from mlmem.schema import short_repr

from .answers import format_values, outcome_to_dict
from .topics import ERROR, OK, WARN, Qos, Status, Topic, parse_status

SHOT_HEAD_SIZE = 9
"""Numbers that describe a shot, before its samples."""

READ_HEAD_SIZE = SHOT_HEAD_SIZE + 4
"""Numbers that describe a shot of a read."""


class ReadShot(NamedTuple):
    """A pulse of a read, and what became of the read.

    Attributes:
        level: The level as decoded; -1 blank, -2 undecodable.
        tick: Tick after which the read was published.
        disturbed: Whether the base shook.
    """

    shot: Shot
    level: int
    tick: int
    disturbed: bool


@dataclass(frozen=True)
class Stream(Topic):
    """What a node publishes on one topic.

    Attributes:
        when: Types of the events that it reports, or the parameter with the ticks between two of
            its messages.
        values: Returns what it says of an element and the event, or of None between events, in
            the form that the type of its messages takes (see the node's `Publishers`); None if
            it says nothing.
        of: The elements that have it: `wall` (of one wall), `register`, `simulated`; empty: all.
        dimensions: Labels and sizes of the dimensions of an array; -1 is the size that follows.
        offset: Numbers before the array.
        is_recorded: Whether a session keeps it; others are made only for subscribers.
    """

    when: tuple[type[Event], ...] | str = ()
    values: Callable[[MemoryElement, Any], Any] = lambda element, event: None
    of: str = ''
    dimensions: tuple[tuple[str, int], ...] = ()
    offset: int = 0
    is_recorded: bool = True

    @property
    def is_periodic(self) -> bool:
        """Whether it is published every few ticks."""
        return isinstance(self.when, str)

    def reports_event(self, event: Event) -> bool:
        """Return whether it is published at an event."""
        return not isinstance(self.when, str) and isinstance(event, self.when)


# --- values -----------------------------------------------------------------------------------


def find_content(element: MemoryElement, _: Any) -> int:
    """Return the content: a level or word from 0, -1 blank, -2 undecodable or unknown."""
    return UNDECODABLE if element.reading is None else element.reading.content


def describe_content(element: MemoryElement, _: Any = None) -> Status:
    """Return the content in words, a warning if it is not known, and why."""
    reading, unknown = element.reading, element.unknown
    if reading is not None:
        found = {element.content_name: str(reading.content)}
        if reading.reason:
            found['reason'] = reading.reason
        text = element.describe_content(reading.content)
        if reading.content == UNDECODABLE:
            return Status(WARN, f'{text}: {reading.reason}', found)
        return Status(OK, text, found)
    found = {element.content_name: str(UNDECODABLE)}
    if unknown is None:
        return Status(WARN, 'not read yet', found)
    since = {'reason': unknown.reason, 'since': str(unknown.since)}
    return Status(WARN, str(unknown), found | since)


def describe_outcome(_: MemoryElement | None, outcome: Outcome) -> Status:
    """Return how a procedure ended in words, and its values as texts."""
    found = format_values(outcome_to_dict(outcome))
    if outcome.success:
        return Status(OK, f'{outcome.procedure} succeeded', found)
    return Status(ERROR, outcome.error, found)


def encode_echo(_: MemoryElement | None, event: EchoReceived) -> Array:
    """Return the rows t, v_m and v_c of an echo (time units and cells)."""
    echo = event.echo
    return np.stack((echo.t, echo.v_m, echo.v_c)).astype(np.float32)


def encode_shot(_: MemoryElement | None, shot: Shot) -> Array:
    """Return a shot as the numbers of its message, `SHOT_HEAD_SIZE` of them before its samples."""
    head = (
        shot.end.row, shot.omega_c, shot.A, shot.sigma, shot.wall, shot.strain, shot.dt, *shot.rest
    )  # fmt: skip
    return np.concatenate((head, shot.samples.ravel()))


def encode_read_shot(element: MemoryElement, event: EchoReceived) -> Array | None:
    """Return a pulse of a read as the numbers of its message, `READ_HEAD_SIZE` of them before its
    samples, or None if the read did not record what both ends did.
    """
    echo = event.echo
    if echo.shot is None:
        return None
    encoded = encode_shot(None, echo.shot)
    read = echo.shot.unrest, event.reading.level, element.ticks, echo.shaken or echo.spoiled
    return np.concatenate((encoded[:SHOT_HEAD_SIZE], read, encoded[SHOT_HEAD_SIZE:]))


def decode_shot(data: Array, offset: int) -> Shot:
    """Return the shot that `encode_shot` gave, `offset` of them before the samples.

    Raises:
        ValueError: They are not a shot.
    """
    head, rows = data[:SHOT_HEAD_SIZE], data[SHOT_HEAD_SIZE:]
    if offset != SHOT_HEAD_SIZE or len(rows) < 2 or len(rows) % 2:
        raise ValueError(
            f'data must be {SHOT_HEAD_SIZE} numbers, then 2 rows of samples; got {len(data)} '
            f'numbers, {offset} of them before the rows'
        )
    if not np.isfinite(head).all() or np.isinf(rows).any() or min(head[[1, 3, 6]]) <= 0.0:
        raise ValueError(
            'end, carrier, amplitude, sigma, wall, strain, interval and the rests must be finite, '
            f'carrier, sigma and interval above 0; got {short_repr(head)}'
        )
    number, omega_c, A, sigma, wall, strain, dt = map(float, head[:7])
    end = End.RIGHT if number else End.LEFT
    return Shot(end, omega_c, A, sigma, wall, strain, dt, head[7:], rows.reshape(2, -1))


def decode_read_shot(data: Array) -> ReadShot:
    """Return the pulse of a read that `encode_read_shot` gave; raises as `decode_shot`."""
    head, read, rows = np.split(data, (SHOT_HEAD_SIZE, READ_HEAD_SIZE))
    unrest, level, tick, disturbed = map(float, read)
    shot = replace(decode_shot(np.concatenate((head, rows)), SHOT_HEAD_SIZE), unrest=unrest)
    return ReadShot(shot, int(level), int(tick), bool(disturbed))


def measure_distance(element: MemoryElement, event: EchoReceived) -> dict[str, Any]:
    """Return the fields of a Range: the distance from the probed end to the wall, infinite without
    an echo, and the length of the element, in m.
    """
    length = element.settings.scale.length
    return {
        'radiation_type': 0,  # ultrasound
        'field_of_view': 0.0,
        'min_range': 0.0,
        'max_range': float(np.float32(element.design.N * length)),
        'range': float(np.float32(event.reading.distance * length)),
        'variance': 0.0,
    }


def measure_joints(element: MemoryElement, _: Any) -> dict[str, Any]:
    """Return displacements (m) and speeds (m/s) of the substrate's end and of v_1, and the forces
    on them (N) if the driver measures any.
    """
    scale, driver = element.settings.scale, element.driver
    force = driver.force()
    return {
        'name': [JOINT_NAME, 'transducer'],
        'position': array('d', (driver.V_N * scale.length, driver.end(1) * scale.length)),
        'velocity': array(
            'd', (element.substrate_speed * scale.speed, element.transducer.speed * scale.speed)
        ),
        'effort': array('d', () if force is None else (force * scale.force, 0.0)),
    }


# --- the table --------------------------------------------------------------------------------

STREAMS = {
    stream.name: stream
    for stream in (
        Stream(
            'echo',
            'std_msgs/msg/Float32MultiArray',
            Qos.RELIABLE,
            'one message for each probe pulse; rows: time, displacement v_m, demodulated signal '
            'v_c',
            when=(EchoReceived,),
            values=encode_echo,
            dimensions=(('channel', 3), ('sample', -1)),
        ),
        Stream(
            'range',
            'sensor_msgs/msg/Range',
            Qos.STREAM,
            'distance from the probed end to the domain wall in m; +inf when no echo came back',
            when=(EchoReceived,),
            values=measure_distance,
        ),
        Stream(
            'waveform',
            'std_msgs/msg/Float64MultiArray',
            Qos.RELIABLE,
            'one message for each pulse of a survey. The numbers before `data_offset`: end (0 '
            'left, 1 right), carrier, amplitude, sigma, supposed site of the wall (0: blank), '
            'strain, time between samples, displacement of both ends at rest; then rows v_1 and '
            'v_N by sample, NaN where none was taken',
            when=(Shot,),
            values=encode_shot,
            dimensions=(('end', 2), ('sample', -1)),
            offset=SHOT_HEAD_SIZE,
        ),
        Stream(
            'read_waveform',
            'std_msgs/msg/Float64MultiArray',
            Qos.RELIABLE,
            'the same for each pulse of a read by delays, to subscribers alone; four more numbers '
            'before `data_offset`: root mean square motion of the ends before the pulse, level as '
            'decoded, tick, and whether the base shook (0, 1)',
            when=(EchoReceived,),
            values=encode_read_shot,
            of='wall',
            dimensions=(('end', 2), ('sample', -1)),
            offset=READ_HEAD_SIZE,
            is_recorded=False,
        ),
        Stream(
            'outcome',
            'diagnostic_msgs/msg/DiagnosticStatus',
            Qos.LATCHED,
            'how the last procedure ended, with the values of its answer',
            when=(Outcome,),
            values=describe_outcome,
        ),
        Stream(
            'level',
            'std_msgs/msg/Int16',
            Qos.LATCHED,
            'the level of one wall as last decoded; -1: blank; -2: undecodable or unknown, at '
            'once when something may have moved the wall',
            when=(Outcome, Unknown),
            values=find_content,
            of='wall',
        ),
        Stream(
            'word',
            'std_msgs/msg/Int64',
            Qos.LATCHED,
            'the same of a register: the word',
            when=(Outcome, Unknown),
            values=find_content,
            of='register',
        ),
        Stream(
            'content',
            'diagnostic_msgs/msg/DiagnosticStatus',
            Qos.LATCHED,
            'the same as text: level or word, or reason and tick since which it is not known',
            when=(Outcome, Unknown),
            values=describe_content,
        ),
        Stream(
            'joint_states',
            'sensor_msgs/msg/JointState',
            Qos.STREAM,
            '`substrate`: displacement (m), speed (m/s) and force (N) of its end; `transducer`: '
            'displacement of the driven cell',
            when='publish.joint_states_every',
            values=measure_joints,
        ),
        Stream(
            'field',
            'std_msgs/msg/Float32MultiArray',
            Qos.STREAM,
            'the configuration Delta_j of every cell',
            when='publish.field_every',
            values=lambda element, _: element.chain.configuration,
            of='simulated',
            dimensions=(('cell', -1),),
        ),
        Stream(
            'wall',
            'std_msgs/msg/Float64MultiArray',
            Qos.STREAM,
            'true positions of the domain walls in sites, which the device never uses',
            when='publish.wall_every',
            values=lambda element, _: element.walls,
            of='simulated',
            dimensions=(('wall', -1),),
        ),
        Stream(
            'image',
            'sensor_msgs/msg/Image',
            Qos.STREAM,
            'the configuration (site upward) over the last seconds, rgb8',
            when='publish.views_every',
            of='simulated',
            is_recorded=False,
        ),
        Stream(
            'markers',
            'visualization_msgs/msg/MarkerArray',
            Qos.STREAM,
            'the chain for RViz and Foxglove: cells by phase, substrate, levels, walls, content',
            when='publish.views_every',
            of='simulated',
            is_recorded=False,
        ),
    )
}
"""All streams by name, in the order in which they are published."""


def select_streams(register: bool, simulated: bool) -> list[Stream]:
    """Return the streams of an element: of a register, or else of one wall."""
    kinds = {'', 'register' if register else 'wall', 'simulated' if simulated else ''}
    return [stream for stream in STREAMS.values() if stream.of in kinds]


def parse_message(stream: Stream, message: Any) -> Any:
    """Return the values of a message from a bag, as `Stream.values` returns them."""
    if stream.type.endswith('/DiagnosticStatus'):
        return parse_status(message)
    if stream.dimensions:
        return np.asarray(message.data)
    names = [each.name for each in fields(message) if each.default is MISSING]  # no constants
    values = {name: getattr(message, name) for name in names if name != 'header'}
    return values['data'] if values.keys() == {'data'} else values
