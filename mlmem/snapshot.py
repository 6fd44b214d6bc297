# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole state of an idle device as plain values, restored bit by bit; and its hash."""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass
from functools import partial
from typing import Any

import numpy as np

from .element import MemoryElement
from .errors import ErrorCode, Refused
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
from .readers.reading import UNDECODABLE, Reading, Unknown
from .schema import Problem, describe_field

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
        why = f'busy: {element.procedure} is running; only an idle device has a snapshot'
        raise Refused(ErrorCode.BUSY, reason=why)
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
        raise Refused(ErrorCode.BUSY, reason=f'busy: {element.procedure} is running')
    try:
        saved = decode_value(Snapshot, snapshot)
        for conflict in _find_conflicts(element, saved):
            raise StateError(ErrorCode.CONFLICT, *conflict)
        specimen = element.specimen(saved.faults)
    except (KeyError, ValueError, Refused) as error:
        raise StateError.of_error(error, place='snapshot') from error
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


def _find_conflicts(element: MemoryElement, saved: Snapshot) -> Iterator[Problem]:
    """Yield the values that a device of this design and these settings cannot have.

    Raises:
        SettingsError, Refused: A part cannot have its values.
    """
    if saved.design != element.design:
        yield Problem('design', saved.design, 'that of the device')
    saved.calibration.check(element.design.levels, element.settings.read.primary_end)
    counted = len(element.statistics.level_writes)
    for name in ('level_writes', 'level_ticks'):
        if (found := len(getattr(saved.statistics, name))) != counted:
            yield Problem(f'statistics.{name}', found, f'those of {counted} levels')
    if not element.is_simulated:
        return
    element.base.check(saved.base.acceleration)
    element.base.check(saved.base.target)
    element.actuator.check_state(saved.actuator)
    top = element.reader.content_count - 1
    if saved.reading and not UNDECODABLE <= saved.reading.level <= top:
        yield Problem('reading.level', saved.reading.level, f'from {UNDECODABLE} to {top}')
    for name in ('last_moved', 'random_since'):
        if (tick := getattr(saved, name)) > saved.ticks:
            yield Problem(name, tick, f'a past tick, at most ticks = {saved.ticks}')
    if (chain := saved.chain) is None:
        yield Problem('chain', None, 'that of a simulated element')
        return
    transducer, sensors = saved.transducer, saved.sensors
    if transducer.returns.keys() != set(End):
        yield Problem('transducer.returns', list(transducer.returns), 'of both ends')
    late = element.sensors.count_late_samples(saved.faults)
    for name, values, shapes in (
        ('transducer.recent', transducer.recent, [element.transducer.recent.shape]),
        ('sensors.late', sensors.late, [(2, 0), (2, late)]),
        ('sensors.slow', sensors.slow, [(2,)]),
        ('chain.values', chain.values, [element.chain.state().shape]),
    ):
        if values is not None and values.shape not in shapes:
            yield Problem(name, values.shape, f'of shape {shapes[-1]}')
    if (largest := np.abs(chain.values).max()) > 1e12:  # far beyond any real state
        yield Problem('chain.values', largest, 'at most 1e12')
    if chain.steps != (steps := saved.ticks * element.steps_per_tick):
        yield Problem('chain.steps', chain.steps, f'{steps}, of ticks of time.tick')
    if (commanded := saved.linkage.commanded) != (strain := saved.actuator.strain):
        yield Problem('linkage.commanded', commanded, f'{strain:g}, the strain of the actuator')
    V_N = element.design.end_displacement(saved.linkage.strain)
    if not math.isclose(chain.V_N, V_N):
        yield Problem('chain.V_N', chain.V_N, f'{V_N:g}, as strained by the linkage')


def hash_state(element: MemoryElement) -> str:
    """Return a hash of the material's state and clock: equal for equal bits."""
    chain = element.chain
    hashed = hashlib.blake2b(digest_size=16)
    hashed.update(struct.pack('<qqd', element.ticks, chain.steps_done, chain.V_N))
    hashed.update(np.ascontiguousarray(chain.state(), dtype='<f8').tobytes())
    return hashed.hexdigest()
