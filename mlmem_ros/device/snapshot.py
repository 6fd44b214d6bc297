# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole state of an idle device as plain values, restored bit by bit; and its hash."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import itertools
import math
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..clipped import clipped, printable
from ..physics import StateError
from ..physics.potential import Array
from .base import BaseState
from .calibration import Calibration, calibration_key
from .decoding import primary
from .element import MemoryElement
from .end import End
from .errors import Refused
from .faults import Faults
from .linkage import LinkageState
from .memory_statistics import MemoryStatistics
from .motion import Profile, Ramp
from .reading import UNDECODABLE, Reading, Unknown
from .reverberation import Returns

LINKAGE = {
    'told': 'commanded', 'drive': 'encoder_strain', 'strain': 'strain', 'slipping': 'slipping'
}  # fmt: skip
"""Keys of `linkage`, and the fields of its state."""

MOST = 1e12
"""Largest accepted displacement, velocity or acceleration: far beyond any real one."""


def take(element: MemoryElement) -> dict[str, Any]:
    """Return the state of a device: all that its future depends on, beside design and settings, as
    values for JSON that keep every bit.

    The content of a real element stays in the element.

    Raises:
        Refused: A procedure runs.
    """
    if element.procedure:
        raise Refused(f'busy: {element.procedure} is running; only an idle device has a snapshot')
    reading = element.reading and dataclasses.asdict(element.reading)
    if reading:
        del reading['shapes']  # only calibrating asks for them
        if math.isinf(reading['distance']):
            reading['distance'] = None  # JSON has no infinity
    material = {}
    if element.simulated:
        chain = element.chain
        material = {'steps': chain.steps_done, 'V_N': chain.V_N, 'state': _encode(chain.state())}
    return {
        'design': dataclasses.asdict(element.design),
        'ticks': element.ticks,
        **material,
        'recent': _encode(element.transducer.recent),
        'returns': {
            end.value: dataclasses.asdict(each.returns)
            for end, each in element.transducer.reverberation.items()
        },
        'stirred': element.stirred,
        'actuator': {
            **dataclasses.asdict(element.actuator.motion),
            'strain': element.actuator.strain,
            'elapsed': element.actuator.elapsed,
        },
        'linkage': {key: getattr(element.linkage.state, name) for key, name in LINKAGE.items()},
        'base': dataclasses.asdict(element.base.state),
        'faults': dataclasses.asdict(element.faults),
        'reading': reading,
        'unknown': element.unknown and dataclasses.asdict(element.unknown),
        'calibration': element.calibration.as_dict(),
        'calibration_key': calibration_key(element.design, element.settings),
        'statistics': dataclasses.asdict(element.statistics),
    }


def restore(element: MemoryElement, snapshot: Mapping[str, Any]) -> None:
    """Restore the state that `take` returned to a device of the same design and settings.

    A real element keeps its content, so only its calibration and statistics are restored. A
    calibration for other pulses or detectors than the device's is ignored.

    Raises:
        StateError: The snapshot is not of such a device; nothing is changed.
        Refused: A procedure runs.
    """
    if element.procedure:
        raise Refused(f'busy: {element.procedure} is running')
    try:
        if element.simulated and 'state' not in snapshot:
            raise ValueError('it is of a real element, or damaged')
        calibration = Calibration.from_dict(snapshot['calibration'])
        calibration.check(element.design.levels, primary(element.settings.read))
        key = calibration_key(element.design, element.settings)
        same_pulses = snapshot.get('calibration_key', key) == key  # not in a replay
        statistics = MemoryStatistics.from_dict(snapshot['statistics'], element.design.levels)
        if not element.simulated:
            if snapshot['design'] != dataclasses.asdict(element.design):
                raise ValueError('its design must agree')
            element.calibration = calibration if same_pulses else element.calibration
            element.statistics = statistics
            return
        motion, strain, elapsed = _motion(snapshot['actuator'])
        linkage = LinkageState(**{LINKAGE[key]: it for key, it in snapshot['linkage'].items()})
        base = BaseState(**snapshot['base'])
        if base.silence != int(base.silence):
            raise ValueError(f'silence must be a whole number of ticks; got {base.silence}')
        faults = Faults(**snapshot['faults'])
        specimen = element.specimen(faults)
        element.base.check(base.acceleration)
        element.base.check(base.target)
        ends = motion.strains if isinstance(motion, Profile) else (motion.start, motion.target)
        for given in (*ends, strain):
            element.actuator.check(given)
        if not all(map(math.isfinite, (linkage.encoder_strain, linkage.strain))):
            raise ValueError(f'the strains of the linkage must be finite; got {linkage}')
        design = snapshot['design']
        reading = _reading(snapshot['reading'], element.design.levels)
        unknown = _unknown(snapshot.get('unknown'))
        ticks, steps = _clock(snapshot['ticks']), _clock(snapshot['steps'])
        recent, state = _decode(snapshot['recent']), _decode(snapshot['state'])
        V_N = float(snapshot['V_N'])
        returns = {end: _returns(snapshot.get('returns', {}).get(end.value)) for end in End}
        stirred = int(snapshot.get('stirred', ticks))
        if stirred > ticks:
            raise ValueError(f'stirred must be a past tick; got {stirred} at tick {ticks}')
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError, Refused) as error:
        raise StateError(
            f'this is not a snapshot of a device: {printable(repr(error), 300)}'
        ) from error
    agree = {
        'its design': design == dataclasses.asdict(element.design),
        'its steps per tick (time.tick, time.integrator)': steps == ticks * element.steps_per_tick,
        'its recent samples': recent.shape == element.transducer.recent.shape
        and bool(np.isfinite(recent).all()),
        'its state': bool((np.abs(state) <= MOST).all()),  # false for NaN, too
        'its strain': linkage.commanded == strain
        and math.isclose(V_N, element.design.end_displacement(linkage.strain)),
    }
    if wrong := [what for what, right in agree.items() if not right]:
        raise StateError(f'this is not a snapshot of such a device: {", ".join(wrong)} must agree')
    element.chain.restore(state, V_N=V_N, steps_done=steps)
    element.chain.set_specimen(specimen)
    element.linkage.state, element.base.state, element.faults = linkage, base, faults
    element.transducer.recent = recent
    element.transducer.release()
    for end, each in element.transducer.reverberation.items():
        each.returns = returns[end]
    element.stirred = stirred
    element.actuator.motion = motion
    element.actuator.strain, element.actuator.elapsed = strain, elapsed
    element.calibration = calibration if same_pulses else element.calibration
    element.reading, element.unknown = reading, unknown
    element.statistics, element.ticks = statistics, ticks


def _clock(count: Any) -> int:
    if isinstance(count, bool) or not isinstance(count, int) or not 0 <= count < 2**62:
        raise ValueError(f'ticks and steps must be whole numbers from 0; got {clipped(count)}')
    return count


def digest(element: MemoryElement) -> str:
    """Return a hash of the material's state and clock: equal for equal bits."""
    chain = element.chain
    hashed = hashlib.blake2b(digest_size=16)
    hashed.update(struct.pack('<qqd', element.ticks, chain.steps_done, chain.V_N))
    hashed.update(np.ascontiguousarray(chain.state(), dtype='<f8').tobytes())
    return hashed.hexdigest()


def _motion(values: Mapping[str, Any]) -> tuple[Ramp | Profile, float, float]:
    """Return the actuator's move, its strain and the time since the move began."""
    strain, elapsed = float(values['strain']), float(values['elapsed'])
    motion: Ramp | Profile
    if 'times' in values:
        times, strains, rates = (
            tuple(map(float, values[name])) for name in ('times', 'strains', 'rates')
        )
        if not 2 <= len(times) == len(strains) or len(rates) not in (0, len(times)):
            raise ValueError(
                'points of a profile have times and strains, and all or none have rates'
            )
        if times[0] != 0.0 or not all(a < b for a, b in itertools.pairwise(times)):
            raise ValueError('the times of a profile increase from 0')
        if not all(map(math.isfinite, rates)):
            raise ValueError('the rates of a profile are finite')
        motion = Profile(times, strains, rates)
    else:
        start, target, duration = (float(values[name]) for name in ('start', 'target', 'duration'))
        motion = Ramp(start, target, duration)
    if not (0.0 <= motion.duration < math.inf and 0.0 <= elapsed < math.inf):
        raise ValueError(f'a move must take a finite time; got {elapsed} of {motion.duration}')
    return motion, strain, elapsed


def _returns(values: Mapping[str, Any] | None) -> Returns:
    """Return what is known of the waves at an end; sessions before 1.1 have nothing."""
    if values is None:
        return Returns(since=0)
    returns = Returns(float(values['bound']), int(values['since']), int(values['seen']))
    if not (0.0 <= returns.bound < math.inf and returns.since >= 0 and returns.seen >= 0):
        raise ValueError(f'the waves at an end must have finite bounds; got {returns}')
    return returns


def _reading(values: Mapping[str, Any] | None, levels: int) -> Reading | None:
    if values is None:
        return None
    distance = values['distance']
    reading = Reading(**{**values, 'distance': math.inf if distance is None else distance})
    if not isinstance(reading.level, int) or not UNDECODABLE <= reading.level < levels:
        raise ValueError(
            f'level must be from {UNDECODABLE} to {levels - 1}; got {clipped(reading.level)}'
        )
    return reading


def _unknown(values: Mapping[str, Any] | None) -> Unknown | None:
    """Return why the content is unknown; sessions before 1.1 do not say."""
    if values is None:
        return None
    reason, since = values['reason'], _clock(values['since'])
    if not isinstance(reason, str):
        raise ValueError(f'reason must be a text; got {clipped(reason)}')
    return Unknown(reason, since)


def _encode(values: Array) -> dict[str, Any]:
    data = np.ascontiguousarray(values, dtype='<f8').tobytes()
    return {'shape': list(values.shape), 'f8': base64.b64encode(data).decode('ascii')}


def _decode(data: Mapping[str, Any]) -> Array:
    raw = base64.b64decode(data['f8'], validate=True)
    return np.frombuffer(raw, dtype='<f8').reshape(data['shape']).astype(np.float64)
