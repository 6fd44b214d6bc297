# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node records at four times the default rates: the input of every writer."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from mlmem_ros.bag import jazzy
from mlmem_ros.physics import CASE_II, Chain, Specimen, substep_times
from mlmem_ros.physics.equilibrium import resting_wall
from mlmem_ros.physics.potential import Array
from mlmem_ros.session.messages import STRING

TICK = 2_000_000
"""Nanoseconds of a default tick."""

STREAM_EVERY = 5
"""Ticks between two messages of the streams field, wall and joint_states."""

ECHO_EVERY = 500
"""Ticks between two reads, and between two hashes of the state."""

MATRIX = 'std_msgs/msg/Float32MultiArray'

TYPES = {
    '/mlmem/field': MATRIX,
    '/mlmem/wall': 'std_msgs/msg/Float64MultiArray',
    '/mlmem/joint_states': 'sensor_msgs/msg/JointState',
    '/mlmem/echo': MATRIX,
    '/mlmem/level': 'std_msgs/msg/Int16',
    '/mlmem/session/state_hash': STRING,
}


@dataclass(frozen=True)
class Message:
    """One message as a recorder gets it: topic, CDR and time in nanoseconds."""

    topic: str
    cdr: bytes
    time: int


def traffic(seconds: float) -> list[Message]:
    """Return the messages of a session: a wall that is strained, and one read a second."""
    chain = Chain(CASE_II, 0.25)
    chain.place(resting_wall(Specimen(CASE_II), 3))
    steps = 80 * STREAM_EVERY
    phase = substep_times(steps, chain.dt)
    messages = []
    for number in range(round(seconds * 1e9 / TICK / STREAM_EVERY)):
        ticks = STREAM_EVERY * (number + 1)
        time = TICK * ticks
        V_N = 2.0 * np.sin(1e-3 * (chain.time + phase))
        ends = chain.advance(V_N)
        messages += [
            _message('/mlmem/field', _array(chain.configuration), time),
            _message('/mlmem/wall', _array(np.array([100.3]), np.float64), time),
            _message('/mlmem/joint_states', _joint_states(chain, time), time),
        ]
        if ticks % ECHO_EVERY == 0:
            echo = np.resize(ends[0], (3, 3200))
            v = [value.hex() for value in chain.v.tolist()]
            messages += [
                _message('/mlmem/echo', _array(echo), time),
                _message('/mlmem/level', {'data': 3}, time),
                _message('/mlmem/session/state_hash', {'data': json.dumps({'v': v})}, time),
            ]
    return messages


def _message(topic: str, fields: dict[str, Any], time: int) -> Message:
    return Message(topic, jazzy.serialize(jazzy.message(TYPES[topic], **fields)), time)


def _array(values: Array, kind: type[np.floating[Any]] = np.float32) -> dict[str, Any]:
    size = values.size
    dimension = jazzy.message(
        'std_msgs/msg/MultiArrayDimension', label='cell', size=size, stride=size
    )
    layout = jazzy.message('std_msgs/msg/MultiArrayLayout', dim=[dimension], data_offset=0)
    return {'layout': layout, 'data': values.astype(kind).ravel()}


def _joint_states(chain: Chain, time: int) -> dict[str, Any]:
    stamp = jazzy.message('builtin_interfaces/msg/Time', sec=time // 10**9, nanosec=time % 10**9)
    return {
        'header': jazzy.message('std_msgs/msg/Header', stamp=stamp, frame_id='mlmem'),
        'name': ['substrate', 'transducer'],
        'position': np.array([chain.V_N, chain.v[0]]),
        'velocity': np.array([0.0, chain.velocity[0]]),
        'effort': np.array([chain.V_N, 0.0]),
    }
