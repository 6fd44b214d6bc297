# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole state of an idle device as plain values, restored to the bit; and its hash."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import math
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..physics import StateError
from ..physics.potential import Array
from .actuator import Motion
from .calibration import Calibration, DelayTable
from .element import MemoryElement
from .errors import Refused
from .reading import Reading


def take(element: MemoryElement) -> dict[str, Any]:
    """Return the state of a device: all that its future depends on beside design and settings.

    Returns:
        Values for JSON; floating-point numbers keep every bit.

    Raises:
        Refused: A procedure runs.
    """
    if element.procedure:
        raise Refused(f'busy: {element.procedure} is running; a snapshot is of an idle device')
    return {
        'ticks': element.ticks,
        'steps': element.chain.steps_done,
        'V_N': element.chain.V_N,
        'state': _encode(element.chain.state()),
        'recent': _encode(element.transducer.recent),
        'actuator': {
            **dataclasses.asdict(element.actuator.motion),
            'strain': element.actuator.strain,
            'elapsed': element.actuator.elapsed,
        },
        'reading': _reading_values(element.reading),
        'calibration': {
            'left': element.calibration.left.as_dict(),
            'right': element.calibration.right.as_dict(),
        },
    }


def restore(element: MemoryElement, snapshot: Mapping[str, Any]) -> None:
    """Set the state that `take` returned, on a device of the same design and settings.

    Raises:
        StateError: The snapshot is not one of such a device; nothing is changed.
        Refused: A procedure runs.
    """
    if element.procedure:
        raise Refused(f'busy: {element.procedure} is running')
    try:
        actuator = dict(snapshot['actuator'])
        strain, elapsed = float(actuator.pop('strain')), float(actuator.pop('elapsed'))
        motion = Motion(**actuator)
        recent = _decode(snapshot['recent'])
        tables = snapshot['calibration']
        calibration = Calibration(
            DelayTable.from_dict(tables['left']), DelayTable.from_dict(tables['right'])
        )
        reading = _reading(snapshot['reading'])
        ticks = int(snapshot['ticks'])
        state, V_N = _decode(snapshot['state']), float(snapshot['V_N'])
        steps = int(snapshot['steps'])
    except (KeyError, TypeError, ValueError) as error:
        raise StateError(f'this is no snapshot of a device: {error!r}') from error
    if recent.shape != element.transducer.recent.shape:
        raise StateError(
            f'the snapshot must hold {element.transducer.recent.shape} recent samples; '
            f'got {recent.shape}'
        )
    element.chain.restore(state, V_N=V_N, steps_done=steps)
    element.transducer.recent = recent
    element.transducer.release()
    element.actuator.strain, element.actuator.elapsed = strain, elapsed
    element.actuator.motion = motion
    element.calibration = calibration
    element.reading = reading
    element.ticks = ticks


def digest(element: MemoryElement) -> str:
    """Return a hash of the material's state and clock: equal for equal bits."""
    chain = element.chain
    hashed = hashlib.blake2b(digest_size=16)
    hashed.update(struct.pack('<qqd', element.ticks, chain.steps_done, chain.V_N))
    hashed.update(np.ascontiguousarray(chain.state(), dtype='<f8').tobytes())
    return hashed.hexdigest()


def _reading_values(reading: Reading | None) -> dict[str, Any] | None:
    if reading is None:
        return None
    values = dataclasses.asdict(reading)
    if math.isinf(reading.distance):
        values['distance'] = None  # JSON has no infinity
    return values


def _reading(values: Mapping[str, Any] | None) -> Reading | None:
    if values is None:
        return None
    distance = values['distance']
    return Reading(**{**values, 'distance': math.inf if distance is None else distance})


def _encode(values: Array) -> dict[str, Any]:
    data = np.ascontiguousarray(values, dtype='<f8').tobytes()
    return {'shape': list(values.shape), 'f8': base64.b64encode(data).decode('ascii')}


def _decode(data: Mapping[str, Any]) -> Array:
    raw = base64.b64decode(data['f8'], validate=True)
    return np.frombuffer(raw, dtype='<f8').reshape(data['shape']).astype(np.float64)
