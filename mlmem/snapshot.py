# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole state of an idle device as plain values, restored bit by bit; and its hash."""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Mapping
from dataclasses import MISSING, dataclass
from functools import partial
from typing import Any

import numpy as np

from .element import MemoryElement
from .errors import Refused
from .instrument.actuator import ActuatorState, TransmissionState
from .instrument.base import BaseState
from .instrument.drivers import ChainState
from .instrument.end import End
from .instrument.faults import Faults, SensorsState
from .instrument.transducer import TransducerState
from .memory import MemoryStatistics
from .parsing import decode_value, encode_value
from .physics import Design, StateError
from .readers.calibration import Calibration, calibration_key
from .readers.decoding import primary_end
from .readers.reading import UNDECODABLE, Reading, Unknown
from .rejections import ErrorCode
from .schema import describe_field, make_printable

_tick = partial(describe_field, low=0, high=2**62)


@dataclass(frozen=True)
class Snapshot:
    """The states of all parts: what the future of a device depends on, besides its settings."""

    design: Design
    calibration: Calibration
    statistics: MemoryStatistics
    actuator: ActuatorState
    linkage: TransmissionState
    base: BaseState
    sensors: SensorsState
    transducer: TransducerState
    faults: Faults
    reading: Reading | None
    unknown: Unknown | None
    ticks: int = _tick(MISSING, 'ticks done')
    last_moved: int = describe_field(MISSING, 'tick of the last motion', high=2**62)
    random_since: int = _tick(0, 'tick from which random numbers are counted')
    calibration_key: str = ''
    chain: ChainState | None = None

    @classmethod
    def from_device(cls, element: MemoryElement) -> Snapshot:
        """Return the present state of a device."""
        return cls(
            element.design, element.calibration, element.statistics, element.actuator.state,
            element.transmission.state, element.base.state, element.sensors.state,
            element.transducer.state, element.faults, element.reading,
            element.unknown, element.ticks, element.last_moved, element.random_since,
            calibration_key(element.design, element.settings), element.driver.state,
        )  # fmt: skip


def take_snapshot(element: MemoryElement) -> dict[str, Any]:
    """Return the state of a device as values for JSON that keep every bit.

    The content of a real element stays in the element.

    Raises:
        Refused: A procedure runs.
    """
    if element.procedure:
        raise Refused(
            f'busy: {element.procedure} is running; only an idle device has a snapshot',
            code=ErrorCode.BUSY,
        )
    values: dict[str, Any] = encode_value(Snapshot.from_device(element))
    return values


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
        saved = decode_value(Snapshot, snapshot)
        _check_values(element, saved)
        specimen = element.specimen(saved.faults)
    except (KeyError, ValueError, Refused) as error:
        why = make_printable(str(error), 300)
        raise StateError(f'this is not a snapshot of a device: {why}') from error
    if element.is_simulated and (wrong := _find_mismatches(element, saved)):
        raise StateError(f'this is not a snapshot of such a device: {", ".join(wrong)} must agree')
    key = calibration_key(element.design, element.settings)
    if saved.calibration_key in ('', key):  # '' in a replay
        element.calibration = saved.calibration
    element.statistics = saved.statistics
    if not element.is_simulated:
        return
    element.driver.state = saved.chain
    element.chain.set_specimen(specimen)
    element.transmission.state, element.base.state = saved.linkage, saved.base
    element.sensors.state, element.transducer.state = saved.sensors, saved.transducer
    element.actuator.state = saved.actuator
    element.faults = saved.faults
    element.reading, element.unknown = saved.reading, saved.unknown
    element.ticks, element.last_moved = saved.ticks, saved.last_moved
    element.random_since = saved.random_since


def _check_values(element: MemoryElement, saved: Snapshot) -> None:
    """Raise `ValueError` or `Refused` unless a device can have these values."""
    if element.is_simulated and saved.chain is None:
        raise ValueError('it is of a real element, or damaged')
    if saved.design != element.design:
        raise ValueError('its design must agree')
    saved.calibration.check(element.design.levels, primary_end(element.settings.read))
    counted, statistics = len(element.statistics.level_writes), saved.statistics
    if {len(statistics.level_writes), len(statistics.level_ticks)} != {counted}:
        raise ValueError(f'the statistics must be for {counted} levels')
    if not element.is_simulated:
        return
    element.base.check(saved.base.acceleration)
    element.base.check(saved.base.target)
    element.actuator.check_state(saved.actuator)
    if saved.reading and not UNDECODABLE <= saved.reading.level < element.reader.content_count:
        raise ValueError(f'there is no level {saved.reading.level}')
    for name in ('last_moved', 'random_since'):
        if (tick := getattr(saved, name)) > saved.ticks:
            raise ValueError(f'{name} must be a past tick; got {tick} at tick {saved.ticks}')
    if saved.transducer.returns.keys() != set(End):
        raise ValueError('returns must be of both ends')


def _find_mismatches(element: MemoryElement, saved: Snapshot) -> list[str]:
    """Return what of a simulated device's snapshot does not fit a device of this design."""
    chain, sensors = saved.chain, saved.sensors
    assert chain is not None
    recent, late = element.transducer.recent, sensors.late
    agree = {
        'its steps per tick (time.tick, time.integrator)': chain.steps
        == saved.ticks * element.steps_per_tick,
        'its recent samples': saved.transducer.recent.shape == recent.shape,
        'its late samples': late.shape
        in ((2, 0), (2, element.sensors.count_late_samples(saved.faults))),
        'its slow signals': sensors.slow is None or sensors.slow.shape == (2,),
        'its state': chain.values.shape == element.chain.state().shape
        # far beyond any real displacement, velocity or acceleration
        and bool((np.abs(chain.values) <= 1e12).all()),
        'its strain': saved.linkage.commanded == saved.actuator.strain
        and math.isclose(chain.V_N, element.design.end_displacement(saved.linkage.strain)),
    }
    return [what for what, right in agree.items() if not right]


def hash_state(element: MemoryElement) -> str:
    """Return a hash of the material's state and clock: equal for equal bits."""
    chain = element.chain
    hashed = hashlib.blake2b(digest_size=16)
    hashed.update(struct.pack('<qqd', element.ticks, chain.steps_done, chain.V_N))
    hashed.update(np.ascontiguousarray(chain.state(), dtype='<f8').tobytes())
    return hashed.hexdigest()
