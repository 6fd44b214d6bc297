# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole state of an idle device as plain values, restored bit by bit; and its hash."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass
from functools import partial
from typing import Any

import numpy as np

from .element import MemoryElement
from .errors import Refused
from .instrument.actuator import TransmissionState
from .instrument.base import BaseState
from .instrument.end import End
from .instrument.faults import Faults
from .instrument.motion import Profile, Ramp
from .instrument.transducer import Returns
from .memory import MemoryStatistics
from .parsing import decode_value, encode_array
from .physics import Design, StateError
from .physics.potential import Array
from .readers.calibration import Calibration, calibration_key
from .readers.decoding import primary_end
from .readers.reading import UNDECODABLE, Reading, Unknown
from .rejections import ErrorCode
from .schema import describe_field, make_printable

_tick = partial(describe_field, low=0, high=2**62)


@dataclass(frozen=True)
class Saved:
    """The snapshot as its keys and their types; a real element has no material."""

    design: Design
    calibration: Calibration
    statistics: MemoryStatistics
    actuator: Mapping[str, Any]
    linkage: TransmissionState
    base: BaseState
    faults: Faults
    reading: Reading | None
    unknown: Unknown | None
    recent: Array
    late: Array
    slow: Array | None
    returns: Mapping[End, Returns]
    script: Sequence[tuple[int, Faults]]
    ticks: int = _tick(MISSING, 'ticks done')
    last_moved: int = describe_field(MISSING, 'tick of the last motion', high=2**62)
    calibration_key: str = ''
    random_since: int = _tick(0, 'tick from which random numbers are counted')
    steps: int = _tick(0, 'steps done')
    V_N: float = 0.0
    state: Array | None = None


def take_snapshot(element: MemoryElement) -> dict[str, Any]:
    """Return the state of a device: all that its future depends on, beside design and settings, as
    values for JSON that keep every bit.

    The content of a real element stays in the element.

    Raises:
        Refused: A procedure runs.
    """
    if element.procedure:
        raise Refused(
            f'busy: {element.procedure} is running; only an idle device has a snapshot',
            code=ErrorCode.BUSY,
        )
    reading = element.reading and dataclasses.asdict(element.reading)
    if reading:
        del reading['shapes']  # only calibrating asks for them
        if math.isinf(reading['distance']):
            reading['distance'] = None  # JSON has no infinity
    material, slow = {}, element.sensors.slow
    if element.simulated:
        chain = element.chain
        material = {
            'steps': chain.steps_done,
            'V_N': chain.V_N,
            'state': encode_array(chain.state()),
        }
    return {
        'design': element.design.as_dict(),
        'ticks': element.ticks,
        **material,
        'recent': encode_array(element.transducer.recent),
        'returns': {
            end.value: dataclasses.asdict(each.returns)
            for end, each in element.transducer.reverberation.items()
        },
        'last_moved': element.last_moved,
        'actuator': {
            **dataclasses.asdict(element.actuator.motion),
            'strain': element.actuator.strain,
            'elapsed': element.actuator.elapsed,
        },
        'linkage': dataclasses.asdict(element.transmission.state),
        'base': dataclasses.asdict(element.base.state),
        'faults': dataclasses.asdict(element.faults),
        'script': [[tick, dataclasses.asdict(faults)] for tick, faults in element.script],
        'random_since': element.random_since,
        'late': encode_array(element.sensors.late),
        'slow': slow if slow is None else encode_array(slow),
        'reading': reading,
        'unknown': element.unknown and dataclasses.asdict(element.unknown),
        'calibration': element.calibration.as_dict(),
        'calibration_key': calibration_key(element.design, element.settings),
        'statistics': dataclasses.asdict(element.statistics),
    }


def restore_snapshot(element: MemoryElement, snapshot: Mapping[str, Any]) -> None:
    """Restore the state that `take_snapshot` returned to a device of the same design and settings.

    A real element keeps its content, so only its calibration and statistics are restored. A
    calibration for other pulses or detectors than the device's is ignored.

    Raises:
        StateError: The snapshot is not of such a device; nothing is changed.
        Refused: A procedure runs.
    """
    if element.procedure:
        raise Refused(f'busy: {element.procedure} is running', code=ErrorCode.BUSY)
    try:
        saved = decode_value(Saved, snapshot)
        state = saved.state
        if element.simulated and state is None:
            raise ValueError('it is of a real element, or damaged')
        calibration, statistics = saved.calibration, saved.statistics
        calibration.check(element.design.levels, primary_end(element.settings.read))
        counted = len(element.statistics.level_writes)
        if {len(statistics.level_writes), len(statistics.level_ticks)} != {counted}:
            raise ValueError(f'the statistics must be for {counted} levels')
        key = calibration_key(element.design, element.settings)
        same_pulses = saved.calibration_key in ('', key)  # '' in a replay
        if saved.design != element.design:
            raise ValueError('its design must agree')
        if state is None:
            element.calibration = calibration if same_pulses else element.calibration
            element.statistics = statistics
            return
        motion, strain, elapsed = _decode_motion(saved.actuator)
        for _, faults in saved.script:
            element.specimen(faults)
        specimen = element.specimen(saved.faults)
        element.base.check(saved.base.acceleration)
        element.base.check(saved.base.target)
        ends = motion.strains if isinstance(motion, Profile) else (motion.start, motion.target)
        for given in (*ends, strain):
            element.actuator.check(given)
        reading, levels = saved.reading, element.reader.content_count
        if reading and not UNDECODABLE <= reading.level < levels:
            raise ValueError(f'level must be from {UNDECODABLE} to {levels - 1}')
        if saved.last_moved > saved.ticks:
            raise ValueError(
                f'last_moved must be a past tick; got {saved.last_moved} at tick {saved.ticks}'
            )
        if saved.random_since > saved.ticks:
            raise ValueError(f'random_since must be a past tick; got {saved.random_since}')
        if saved.returns.keys() != set(End):
            raise ValueError('returns must be of both ends')
    except (KeyError, ValueError, Refused) as error:
        why = make_printable(str(error), 300)
        raise StateError(f'this is not a snapshot of a device: {why}') from error
    agree = {
        'its steps per tick (time.tick, time.integrator)': saved.steps
        == saved.ticks * element.steps_per_tick,
        'its recent samples': saved.recent.shape == element.transducer.recent.shape,
        'its late samples': saved.late.shape in ((2, 0), (2, element.sensors.delay(saved.faults))),
        'its slow signals': saved.slow is None or saved.slow.shape == (2,),
        # far beyond any real displacement, velocity or acceleration
        'its state': bool((np.abs(state) <= 1e12).all()),
        'its strain': saved.linkage.commanded == strain
        and math.isclose(saved.V_N, element.design.end_displacement(saved.linkage.strain)),
    }
    if wrong := [what for what, right in agree.items() if not right]:
        raise StateError(f'this is not a snapshot of such a device: {", ".join(wrong)} must agree')
    element.chain.restore(state, V_N=saved.V_N, steps_done=saved.steps)
    element.chain.set_specimen(specimen)
    element.transmission.state, element.base.state, element.faults = (
        saved.linkage,
        saved.base,
        saved.faults,
    )
    element.script = saved.script
    element.random_since = saved.random_since
    element.sensors.late = saved.late
    element.sensors.slow = saved.slow
    element.transducer.recent = saved.recent
    element.transducer.release()
    for end, each in element.transducer.reverberation.items():
        each.returns = saved.returns[end]
    element.last_moved = saved.last_moved
    element.actuator.motion = motion
    element.actuator.strain, element.actuator.elapsed = strain, elapsed
    element.calibration = calibration if same_pulses else element.calibration
    element.reading, element.unknown = reading, saved.unknown
    element.statistics, element.ticks = statistics, saved.ticks


def hash_state(element: MemoryElement) -> str:
    """Return a hash of the material's state and clock: equal for equal bits."""
    chain = element.chain
    hashed = hashlib.blake2b(digest_size=16)
    hashed.update(struct.pack('<qqd', element.ticks, chain.steps_done, chain.V_N))
    hashed.update(np.ascontiguousarray(chain.state(), dtype='<f8').tobytes())
    return hashed.hexdigest()


def _decode_motion(given: Mapping[str, Any]) -> tuple[Ramp | Profile, float, float]:
    """Return the actuator's move, its strain and the time since the move began."""
    values = dict(given)
    strain, elapsed = (
        decode_value(float, values.pop(name, None), f'actuator.{name}')
        for name in ('strain', 'elapsed')
    )
    motion: Ramp | Profile
    motion = decode_value(Profile if 'times' in values else Ramp, values, 'actuator')
    if isinstance(motion, Profile):
        times, rates = motion.times, motion.rates
        if not 2 <= len(times) == len(motion.strains) or len(rates) not in (0, len(times)):
            raise ValueError(
                'points of a profile have times and strains, and all or none have rates'
            )
        if times[0] != 0.0 or not all(a < b for a, b in itertools.pairwise(times)):
            raise ValueError('the times of a profile increase from 0')
    if motion.duration < 0.0 or elapsed < 0.0:
        raise ValueError(f'a move must take a finite time; got {elapsed} of {motion.duration}')
    return motion, strain, elapsed
