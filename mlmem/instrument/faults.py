# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults of a device. The defaults describe a healthy one.

Each fault acts in one place: on the transducers' signals (`Sensors`), on how they move an end
(`apply_transducer_faults`), between actuator and substrate (`actuator`), or in the material
(`apply_faults`). The device does not know its own faults; it has to detect them.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..errors import Checked, ErrorCode, SettingsError
from ..physics import HeldCell, Scatter, Specimen, draw_specimen
from ..physics.formulas import exponential
from ..physics.values import Array
from ..rng import RandomStream, draw_event, draw_normal
from ..schema import (
    Description,
    describe_field,
    describe_time,
    find_descriptions,
    make_field_factory,
)
from .end import End


@dataclass(frozen=True)
class OfMaterial(Description):
    """The description of a fault of the material, which a real element cannot be given."""


_probability = make_field_factory('', 0.0, 1.0)
_end = partial(describe_field, 'both', choices=('both', 'left', 'right'))
_of_material = make_field_factory('', 0.0, 0.5, kind=OfMaterial)
_cell = make_field_factory('', 0, 100_000, kind=OfMaterial)


@dataclass(frozen=True)
class Faults(Checked):
    """The present faults of a device.

    Random events depend only on `seed` and the tick, so a replay meets the same faults.
    """

    sensor_noise: float = describe_field(
        0.0, 'standard deviation of the noise of the signal', unit='cells', low=0.0, high=1.0
    )
    sensor_dropout: float = _probability(
        0.0, 'probability that the signal freezes at its last sample for a tick'
    )
    sensor_end: str = _end('the transducer whose signal is faulty')
    sensor_off: bool = describe_field(False, 'the signal is 0')
    sensor_gain: float = describe_field(
        1.0, 'the signal, relative to the displacement', low=-10.0, high=10.0
    )
    sensor_lag: float = describe_time(0.0, "time constant of the signal's lag")
    sensor_delay: float = describe_time(0.0, 'delay of the signal', high=1e4)
    transducer_end: str = _end('the transducer whose drive is faulty')
    transducer_off: bool = describe_field(False, 'the transducer does not drive its end')
    transducer_gain: float = describe_field(
        1.0, 'displacement of the transducer, relative to the commanded one', low=-2.0, high=2.0
    )
    actuator_offset: float = describe_field(
        0.0, 'offset of the substrate strain, unknown to the actuator', low=-0.1, high=0.1
    )
    actuator_lag: float = describe_time(0.0, "time constant of the actuator's lag")
    actuator_stuck: bool = describe_field(False, 'the actuator does not move')
    missed_cycle: float = _probability(
        0.0, 'probability that the grip slips for a whole strain cycle'
    )
    weak_cell: int = _cell(0, 'site of the weak cell; 0: none')
    weak_factor: float = _of_material(
        0.5, 'on-site stiffness of the weak cell, relative to nominal', low=0.01, high=1.0
    )
    stuck_cell: int = _cell(0, 'site of the cell that sticks to its substrate cell; 0: none')
    disorder_alpha: float = _of_material(
        0.0, 'standard deviation of every on-site stiffness, relative'
    )
    disorder_k_r: float = _of_material(
        0.0, 'standard deviation of every coupling spring, relative'
    )
    disorder_s: float = _of_material(0.0, 'standard deviation of every substrate spring, relative')
    disorder_depth: float = _of_material(
        0.0, "standard deviation of the difference of a cell's wells, relative to the barrier"
    )
    damping_factor: float = _of_material(1.0, "damping, relative to the design's", high=100.0)
    seed: int = describe_field(
        0, 'seed of the random numbers: noise, drop-out, slips, disorder', low=0, high=2**31 - 1
    )

    def list_active(self) -> dict[str, Any]:
        """Return the active faults by name; empty for a healthy device.

        The seed alone is not a fault, nor is the factor of an absent weak cell, nor the end of an
        absent fault of a signal.
        """
        found = {
            field.name: value
            for field in dataclasses.fields(self)
            if (value := getattr(self, field.name)) != field.default and field.name != 'seed'
        }
        if not self.weak_cell:
            found.pop('weak_factor', None)
        for part in ('sensor', 'transducer'):
            if {name for name in found if name.startswith(part)} == {f'{part}_end'}:
                found.pop(f'{part}_end')
        return found

    def list_material_faults(self) -> dict[str, Any]:
        """Return the active faults that a real element cannot have, by name."""
        active = self.list_active()
        rows = find_descriptions(self)
        return {
            field.name: active[field.name]
            for field, row in rows
            if isinstance(row, OfMaterial) and field.name in active
        }

    @cached_property
    def has_only_material_faults(self) -> bool:
        """Whether strain, signals and driven ends are free of faults."""
        return self.list_active() == self.list_material_faults()

    def has_same_material(self, other: Faults) -> bool:
        """Whether the material is the same with other faults."""
        material = self.list_material_faults()
        same = material == other.list_material_faults()
        return same and (self.seed == other.seed or not material)


NO_FAULTS = Faults()


def apply_faults(made: Specimen, faults: Faults) -> Specimen:
    """Return the material `made` with its faults.

    Raises:
        SettingsError: The design does not have a named cell, or a stuck cell is one that a
            transducer holds.
    """
    design = made.design
    if faults.weak_cell > design.N:
        raise SettingsError(
            ErrorCode.CONFLICT, 'weak_cell', faults.weak_cell, f'from 0 to N = {design.N}'
        )
    if faults.stuck_cell == 1 or faults.stuck_cell >= design.N:
        raise SettingsError(
            ErrorCode.CONFLICT, 'stuck_cell', faults.stuck_cell,
            f'0 or from 2 to N - 1 = {design.N - 1}, because the transducers hold the ends',
        )  # fmt: skip
    scatter = Scatter(
        faults.disorder_alpha, faults.disorder_k_r, faults.disorder_s, depth=faults.disorder_depth
    )
    disorder = draw_specimen(design, scatter, faults.seed)
    alpha = np.asarray(made.alpha_factor * disorder.alpha_factor)
    stuck = made.stuck
    if faults.weak_cell:
        alpha[faults.weak_cell - 1] *= faults.weak_factor
    if faults.stuck_cell:
        stuck += (faults.stuck_cell,)
    return dataclasses.replace(
        made, alpha_factor=alpha, k_r_factor=made.k_r * disorder.k_r,
        s_factor=made.s_factor * disorder.s_factor, stuck=stuck,
        depth=made.depths + disorder.depths, eta_factor=made.eta_factor * faults.damping_factor,
    )  # fmt: skip


def apply_transducer_faults(held: HeldCell, start: Array, faults: Faults) -> HeldCell | None:
    """Return how a transducer moves its end for a motion; None if it leaves the end free.

    `start` is displacement and velocity at which the motion began, shape (2, 1).
    """
    end = 'left' if held.site == 1 else 'right'
    if faults.has_only_material_faults or faults.transducer_end not in ('both', end):
        return held
    if faults.transducer_off:
        return None
    began = start * ((1.0,), (0.0,))
    return HeldCell(held.site, began + faults.transducer_gain * (held.motion - began))


@dataclass(frozen=True)
class SensorsState:
    """The state of the sensors.

    Attributes:
        late: The samples that a late signal still has to show, shape (2, m).
        slow: Where a slow signal is, without the noise of its samples, shape (2,); or None.
    """

    late: Array
    slow: Array | None = None


class Sensors:
    """The signals of both transducers, with their faults.

    Attributes:
        state: What the signals have still to show.
    """

    def __init__(self, dt: float) -> None:
        """Watch ends whose samples are `dt` apart."""
        self.dt = dt
        self.state = SensorsState(np.empty((2, 0)))

    def count_late_samples(self, faults: Faults) -> int:
        """Return how many samples late the signals are."""
        return round(faults.sensor_delay / self.dt)

    def change_faults(self, faults: Faults) -> None:
        """Forget what the signals have still to show, unless they stay as late as they are, and
        where they are unless they stay slow.
        """
        late, slow = self.state.late, self.state.slow
        if late.shape[1] != self.count_late_samples(faults):
            late = np.empty((2, 0))
        self.state = SensorsState(late, slow if faults.sensor_lag else None)

    def apply_sensor_faults(self, ends: Array, last: Array, faults: Faults, tick: int) -> Array:
        """Return the samples of both ends in a tick, shape (2, steps), as transducers with faults
        measure them.

        `ends` are the true displacements, and `last` the last samples before, shape (2,).
        """
        if faults.has_only_material_faults:
            return ends
        present = self._delay_signal(ends, last, self.count_late_samples(faults))
        found = 0.0 * present if faults.sensor_off else faults.sensor_gain * present
        if faults.sensor_lag:
            found = self._lag_signal(found, last, faults.sensor_lag)
        if draw_event(faults.sensor_dropout, faults.seed, tick, RandomStream.DROPOUT):
            found = np.repeat(last[:, None], ends.shape[1], axis=1)
        elif faults.sensor_noise:
            noise = draw_normal(ends.shape, faults.seed, tick, RandomStream.NOISE)
            found = found + faults.sensor_noise * noise
        if faults.sensor_end != 'both':
            sound = End(faults.sensor_end).opposite.row
            found[sound] = ends[sound]
        return found

    def _delay_signal(self, ends: Array, last: Array, m: int) -> Array:
        """Return what is shown m samples late; a delay begins with the last sample before."""
        late = self.state.late
        if late.shape[1] != m:
            late = np.repeat(last[:, None], m, axis=1)
        shown = np.concatenate((late, ends), axis=1)
        self.state = SensorsState(shown[:, ends.shape[1] :].copy(), self.state.slow)
        return shown[:, : ends.shape[1]]

    def _lag_signal(self, wanted: Array, last: Array, constant: float) -> Array:
        """Return a signal behind a first-order lag, which begins with the last sample before."""
        kept = float(exponential(np.array([-self.dt / constant]))[0])
        slow = self.state.slow
        found, at = np.empty_like(wanted), last if slow is None else slow
        for k in range(wanted.shape[1]):
            at = wanted[:, k] + kept * (at - wanted[:, k])
            found[:, k] = at
        self.state = SensorsState(self.state.late, found[:, -1].copy())
        return found
