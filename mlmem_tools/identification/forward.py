# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The forward model: what both ends of an element do after a pulse, and its derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mlmem.instrument.end import End, Shot
from mlmem.physics import (
    SUBSTEPS_PER_STEP,
    Chain,
    HeldCell,
    Specimen,
    StateError,
    find_walls,
    substep_times,
)
from mlmem.physics.equilibrium import relax_to_equilibrium, wall_profile
from mlmem.physics.jit import compile_kernel
from mlmem.physics.values import Array

from . import tangent
from .unknowns import SHARED_UNKNOWNS, Unknowns, skew_law

INTERPOLATION_NODES = 8
"""Neighbours between which a waveform is interpolated."""

Waveforms = TypeVar('Waveforms', Array, tangent.Single)


@dataclass(frozen=True)
class Clock:
    """How the motion between samples is computed.

    Attributes:
        parts: Steps between two samples that are compared.
        stride: Samples between those that are compared.
    """

    parts: int
    stride: int

    @classmethod
    def of(cls, dt: float, simulated: bool = False) -> Clock:
        """Return the clock for samples dt apart, of a simulated element, whose steps are repeated
        with their errors, or a real one.
        """
        if simulated:
            return cls(1, 1)
        max_step = 0.35  # largest step in time units: the error is below 1e-6 cells then
        return cls(max(1, math.ceil(dt / max_step)), max(1, math.floor(max_step / dt)))


def solve_equilibrium(specimen: Specimen, wall: float, strain: float) -> Array:
    """Return the displacements of an element at rest, shape (N,).

    Args:
        wall: Site near which its wall rests, 0 for a blank element.
        strain: Strain, held; it must not free the wall.

    Raises:
        StateError: There is no such equilibrium.
    """
    design = specimen.design
    V = design.end_displacement(strain) * specimen.strain_shape
    v = wall_profile(design, wall) if wall else np.full(design.N, design.D_s1)
    return relax_to_equilibrium(specimen, v + specimen.offsets + V, V)


class Forward:
    """Predicts the shots of an element with given values of the unknowns.

    Attributes:
        x: The values, shape (size,).
    """

    def __init__(self, unknowns: Unknowns, x: Array, simulated: bool = False) -> None:
        """Make the element.

        Args:
            simulated: Whether the measured element is simulated, so that its steps are repeated.

        Raises:
            DesignError: There is no such element.
        """
        self.unknowns, self.x = unknowns, x
        self.specimen = unknowns.specimen(x)
        self._simulated = simulated
        self._rest: dict[tuple[float, float], Array] = {}
        self._chains: dict[float, Chain] = {}
        self._predicted: dict[tuple[Shot, float, float], Array] = {}

    def rest(self, shot: Shot) -> Array:
        """Return the displacements before a shot, shape (N,).

        Raises:
            StateError: There is no such equilibrium.
        """
        key = shot.wall, shot.strain
        if key not in self._rest:
            self._rest[key] = solve_equilibrium(self.specimen, *key)
        return self._rest[key]

    def predict(self, shot: Shot, duration: float, held_off: float = 0.0) -> Array:
        """Return the readings of both ends at rest and at the compared samples, (2, m + 1), for a
        duration after the pulse began; `held_off` is by how much the driven end is held from where
        it rests, in cells.

        Raises:
            StateError: There is no such equilibrium, or the motion becomes unstable.
            DesignError: The step is beyond the stability limit.
        """
        key = shot, duration, held_off
        if key not in self._predicted:
            self._predicted[key] = self.predict_exchange([shot], duration, held_off)
        return self._predicted[key]

    def predict_exchange(
        self, shots: Sequence[Shot], duration: float, held_off: float = 0.0
    ) -> Array:
        """Return what `predict` does for pulses one after the other into the same element; their
        samples end together.

        Raises:
            StateError, DesignError: As in `predict`.
        """
        first, design, unit = shots[0], self.specimen.design, self._unknown_value('time_unit')
        clock, steps = self._plan_steps(first, duration)
        dt = first.dt * clock.stride / clock.parts
        late = self.unknowns.end_values(self.x, 'late') / dt
        further = _count_extra_steps(late)
        chain = self._build_chain(dt * unit)
        v = self.rest(first)
        chain.place(v, design.end_displacement(first.strain))
        begins = [self.begin(first, shot) * clock.parts for shot in shots]
        parts = [v[[0, -1], None]]
        until = [*begins[1:], steps + further]
        for shot, begin, end in zip(shots, begins, until, strict=True):
            motion = self._driven_motion(shot, dt, end - begin)
            site = shot.end.site(design)
            gain = self.unknowns.end_values(self.x, 'drive')[shot.end.row]
            held = gain * motion / np.array([[1.0], [unit]])
            held[0] += v[site - 1] + held_off
            V_N = np.full(SUBSTEPS_PER_STEP * (end - begin), chain.V_N)
            parts.append(chain.advance(V_N, HeldCell(site, held)))
        zero, gain = (self.unknowns.end_values(self.x, what)[:, None] for what in ('zero', 'gain'))
        times = np.arange(0, steps + 1, clock.parts) - late[:, None]
        ends = sample_waveforms(np.concatenate(parts, axis=1), times)
        return np.asarray(zero + gain * ends)

    def _build_chain(self, dt: float) -> Chain:
        """Return the element as a chain, made once a step: its limits take longer than a shot."""
        if dt not in self._chains:
            chain = Chain(self.specimen, dt)
            if 'damping' in self.unknowns.terms:
                chain.set_damping(self._damping_ratios)
            self._chains[dt] = chain
        return self._chains[dt]

    def begin(self, first: Shot, shot: Shot) -> int:
        """Return after how many compared samples of the first shot another one began."""
        late: int = first.samples.shape[1] - shot.samples.shape[1]
        return late // Clock.of(first.dt, self._simulated).stride

    def linearise_exchange(
        self, shots: Sequence[Shot], duration: float
    ) -> tuple[Array, tangent.Single]:
        """Return what `predict_exchange` does, and its derivatives: waves of small pulses add up.

        Raises:
            StateError, DesignError: As in `predict`.
        """
        predicted = self.predict_exchange(shots, duration)
        compared = np.arange(predicted.shape[1])
        total = self.linearise_shot(shots[0], duration)
        for shot in shots[1:]:
            begin = self.begin(shots[0], shot)
            J = self.linearise_shot(shot, duration - begin * shot.dt)
            total = total + J[:, np.clip(compared - begin, 0, J.shape[1] - 1)] - J[:, :1]
        return predicted, total

    def linearise_shot(
        self, shot: Shot, duration: float, patterns: Array = tangent.NO_PATTERNS
    ) -> tangent.Single:
        """Return the derivatives of `predict` by all unknowns, shape (2, m + 1, size).

        Args:
            shot: The pulse.
            duration: How long after it began.
            patterns: Of alpha, shape (k, N). If there are any, derivatives by these and by what
                all cells share are all that is returned, shape (2, m + 1, k + shared), and take
                less time.

        Raises:
            StateError, DesignError: As in `predict`.
        """
        predicted = self.predict(shot, duration)
        unknowns, design, made = self.unknowns, self.specimen.design, self.specimen
        clock, steps = self._plan_steps(shot, duration)
        unit, eta = self._unknown_value('time_unit'), self._unknown_value('eta')
        V_N = design.end_displacement(shot.strain)
        origins = -np.ones((1, design.N))
        if V_N:
            origins = np.concatenate((origins, V_N * unknowns.substrate_rates(self.x)))
        material = tangent.Material(
            made.alpha * design.d,
            made.offsets + V_N * made.strain_shape + design.potential.origin,
            made.masses + 0.0, made.k_r + 0.0, origins, self._build_law(), unit * unit,
            unit * eta * self._damping_ratios,
            frozenset() if len(patterns) else unknowns.terms, patterns,
        )  # fmt: skip
        before = len(patterns) or design.N
        column = {name: before + k for k, name in enumerate(SHARED_UNKNOWNS)}
        samples, interval = steps // clock.parts, shot.dt * clock.stride
        # steps of a sample, or samples of a step
        # largest step of the derivatives: they are a hundredth of their size off then, and a fit
        # only descends along them; it compares with the motion alone
        max_derivative_step = 0.5
        parts = (
            float(math.ceil(interval / max_derivative_step))
            if interval > max_derivative_step
            else 1.0 / (max_derivative_step // interval)
        )
        dt = interval / parts
        late = unknowns.end_values(self.x, 'late') / dt
        steps = math.ceil(samples * parts) + _count_extra_steps(late)
        motion = self._driven_motion(shot, dt, steps)
        motion = motion[:, : motion.shape[1] // 5 * 5]
        gains = unknowns.end_values(self.x, 'drive')
        source = tangent.Source(
            shot.end.site(design) - 1, np.ascontiguousarray(motion), float(gains[shot.end.row])
        )
        raw = tangent.run_tangent(material, self.rest(shot), source, dt, steps)
        raw = sample_waveforms(raw, parts * np.arange(samples + 1) - late[:, None])
        J = self._derive_by_unknowns(shot, raw, material, column)
        for end, zero, gain in zip(
            End,
            unknowns.end_values(self.x, 'zero'),
            unknowns.end_values(self.x, 'gain'),
            strict=True,
        ):
            J[end.row, :, column[f'gain_{end}']] = (predicted[end.row] - zero) / gain
        if 'latency' in unknowns.terms:
            half, at = np.array(((0.5,), (0.5,))), np.arange(samples + 1)
            later = sample_waveforms(predicted, at - half) - sample_waveforms(predicted, at + half)
            later /= interval
            J[..., column[f'lag_{shot.end}']] = later
            for end in End:
                J[end.row, :, column[f'late_{end}']] = later[end.row]
        return J

    def _derive_by_unknowns(
        self, shot: Shot, raw: tangent.Single, material: tangent.Material,
        column: Mapping[str, int],
    ) -> tangent.Single:  # fmt: skip
        """Return derivatives by the unknowns, from those by the quantities of a run."""
        unknowns, d = self.unknowns, np.float32(self.specimen.design.d)
        unit, eta = self._unknown_value('time_unit'), self._unknown_value('eta')
        first, q, patterns = (
            material.first_shared_column,
            len(material.origins),
            len(material.patterns),
        )
        size = patterns + len(SHARED_UNKNOWNS) if patterns else unknowns.size
        J = np.zeros((*raw.shape[:2], size), np.float32)
        last = material.first_pattern_column
        if patterns:
            J[..., :patterns] = d * raw[..., last:]
        else:
            J[..., unknowns.alpha] = d * raw[..., : material.height_count]
            for term, where in unknowns.cells.items():
                J[..., where] = raw[..., material.columns[term]]
        if 'damping' in material.terms:
            J[..., unknowns.cells['damping']] /= self._damping_ratios
        *of_law, forces, damping, friction, drive = np.moveaxis(raw[..., first + q : last], -1, 0)
        of_law.append(raw[..., first])
        rates = unknowns.law_rates(self.x)
        for k, name in enumerate(('D_s1', 'D_s2', 'c')):
            J[..., column[name]] = sum(
                rate * by for rate, by in zip(rates[:, k], of_law, strict=True)
            )
        J[..., column['eta']] = unit * damping
        J[..., column['time_unit']] = 2.0 * unit * forces + eta * damping
        for k, name in enumerate(('substrate_ratio', 'j_0')[: q - 1]):
            J[..., column[name]] = raw[..., first + 1 + k]
        J[..., column[f'drive_{shot.end}']] = drive
        if 'friction' in unknowns.terms and not patterns:
            J[..., -1] = friction
        J *= unknowns.end_values(self.x, 'gain').astype(np.float32)[:, None, None]
        for end in End:
            J[end.row, :, column[f'zero_{end}']] = 1.0
        return J

    def _build_law(self) -> tangent.Phases | tangent.Spline:
        """Return the on-site law as a tangent run takes it, per d."""
        law = self.specimen.design.law
        if law is None:
            return tangent.Phases(self.specimen.design.a, self.specimen.design.b)
        skew = skew_law(self.unknowns.design)
        return tangent.Spline(law.d * law.pieces, law.d * skew.pieces, 1.0 / law.step)

    @property
    def _damping_ratios(self) -> Array:
        """Damping of every cell over eta, shape (N,)."""
        known = np.ones(self.specimen.design.N)
        return np.asarray(self.unknowns.cell_values(self.x, 'damping', known))

    def _unknown_value(self, name: str) -> float:
        return float(self.x[self.unknowns.shared(name)])

    def _plan_steps(self, shot: Shot, duration: float) -> tuple[Clock, int]:
        clock = Clock.of(shot.dt, self._simulated)
        samples = math.ceil(max(0.0, duration) / shot.dt)
        samples = min(samples, shot.samples.shape[1]) // clock.stride
        return clock, samples * clock.parts

    def _driven_motion(self, shot: Shot, dt: float, steps: int) -> Array:
        """Return the motion of the driven end from its rest in the instrument's time, (2, m)."""
        times = substep_times(steps, dt) - self._unknown_value(f'lag_{shot.end}')
        return shot.pulse.evaluate_motion(times[times <= shot.pulse.duration])


def sample_waveforms(waveforms: Waveforms, times: Array) -> Waveforms:
    """Return waveforms of both ends, (2, n, ...), at times that count their steps, shape (2, m).

    Lagrange's polynomial through eight neighbours is exact to 1e-6 for a third of a radian a step,
    and to 1e-3 for one radian; before and after, a waveform keeps its value.
    """
    whole = np.floor(times).astype(np.int64)
    share, last = times - whole, waveforms.shape[1] - 1
    if not share.any():
        whole = np.clip(whole, 0, last)
        return np.stack([of_end[at] for of_end, at in zip(waveforms, whole, strict=True)])
    nodes = np.arange(INTERPOLATION_NODES) - INTERPOLATION_NODES // 2 + 1
    weights = np.ones((*times.shape, INTERPOLATION_NODES), waveforms.dtype)
    for k, node in enumerate(nodes):
        for other in nodes[nodes != node]:
            weights[..., k] *= (share - other) / (node - other)
    found = np.zeros((*times.shape, *waveforms.shape[2:]), waveforms.dtype)
    rows = waveforms.reshape(*waveforms.shape[:2], -1)
    _interpolate_rows(rows, whole + nodes[0], weights, found.reshape(*times.shape, -1))
    return found


@compile_kernel
def _interpolate_rows(
    rows: Array | tangent.Single,
    first: NDArray[np.int64],
    weights: Array | tangent.Single,
    found: Array | tangent.Single,
) -> None:
    """Add to `found` weighted sums of neighbouring rows, of those that there are."""
    for end in range(len(rows)):
        of_end, last = rows[end], rows.shape[1] - 1
        for k in range(found.shape[1]):
            to = found[end, k]
            for node in range(weights.shape[2]):
                row = of_end[min(max(first[end, k] + node, 0), last)]
                weight = weights[end, k, node]
                for p in range(len(to)):
                    to[p] += weight * row[p]


def _count_extra_steps(late: Array) -> int:
    """Return how many steps beyond the last sample its interpolation needs."""
    return math.ceil(max(0.0, -float(late.min()))) + INTERPOLATION_NODES // 2


MAX_WALL_OFFSET_CELLS = 6.0
"""How far from where it is taken to be a wall may be, in cells."""


def find_equilibria(forward: Forward, shot: Shot, near: float | None = None) -> list[float]:
    """Return the positions at which a wall rests that is let go at any site; if `near` is a site,
    at any that is at most `MAX_WALL_OFFSET_CELLS` from there.
    """
    made = forward.specimen
    sites = np.arange(2.0, made.design.N)
    if near is not None:
        sites = sites[np.abs(sites - near) <= MAX_WALL_OFFSET_CELLS]
    V = made.design.end_displacement(shot.strain) * made.strain_shape
    places: set[float] = set()
    for site in sites:
        try:
            v = forward.rest(replace(shot, wall=float(site)))
        except StateError:
            continue
        inside = find_walls(made.design, v - V)
        if len(inside) == 1:
            places.add(round(inside[0].position, 1))
    return sorted(places)
