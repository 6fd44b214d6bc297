# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of an element before anything was heard, and the misfit between shots and their
prediction.

Gamma, beta and the overall stiffness are patterns of alpha_j that the prior knows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mlmem.instrument.end import Shot
from mlmem.physics import Design, DesignError, StateError
from mlmem.physics.values import Array

from .forward import Clock, Forward
from .noise import estimate_noise, remove_lines, whiten_waveforms
from .tangent import NO_PATTERNS, Single
from .unknowns import SHARED_UNKNOWNS, Unknowns

PRIOR_DEVIATIONS = {
    'scatter': 0.02,  # alpha from cell to cell, relative
    'stiffness': 0.05,  # overall stiffness of the cells, relative
    'gamma': 0.05,  # gradient, relative to the design's
    'beta': 0.05,  # anomaly of the defects, relative to the design's
    'ground_state': 0.05,  # either ground state, in lattice constants
    'c': 0.7,  # offset of the potential, which decides k_s2 / k_s1, in lattice constants
    'skew': 0.1,  # force of a law of its own about its second ground state, relative
    'eta': 0.2,  # damping, relative
    'time_unit': 0.05,  # relative
    'substrate_ratio': 0.05,  # s_max / s_min, relative
    'j_0': 0.5,  # site of least substrate stiffness, in cells
    'zero': 0.02,  # zero of a transducer, in lattice constants
    'gain': 0.02,  # gain of a transducer, as sensor and as driver, relative
    'late': 0.3,  # by which a transducer is late, where that is sought, in time units
    'masses': 0.005,  # mass of a cell, relative
    'offsets': 0.01,  # ground states of a cell, in lattice constants
    'springs': 0.005,  # spring between cells, relative
    'damping': 0.3,  # damping of a cell, relative to eta
    'friction': 1e-5,  # dry friction on every cell, in k_r cells
}
"""Standard deviations of the unknowns about the design, before anything was heard."""


def prior_precision(unknowns: Unknowns, known: Mapping[str, float]) -> Array:
    """Return the inverse of the prior's covariance, shape (size, size).

    Cells scatter independently about the patterns of stiffness, gamma and beta.

    Args:
        unknowns: The unknowns.
        known: Standard deviations by the names of `PRIOR_DEVIATIONS`.
    """
    design, alpha = unknowns.design, unknowns.design.alpha
    relative = np.array([known[name] for name in ('stiffness', 'gamma', 'beta')])
    shared = relative[:, None] * alpha_patterns(design)
    spread = np.diag((known['scatter'] * alpha) ** 2) + shared.T @ shared
    deviations = np.zeros(unknowns.size)
    late = known['late'] if 'latency' in unknowns.terms else 1e-9  # it is known to be on time
    deviations[design.N : unknowns.shared_end] = (
        *(known['ground_state'],) * 2, known['skew' if design.law else 'c'],
        known['eta'] * max(design.eta, 1e-4), known['time_unit'],
        known['substrate_ratio'] * design.s_max / design.s_min, known['j_0'],
        *(known['zero'],) * 2, *(known['gain'],) * 4, *(late,) * 4,
    )  # fmt: skip
    for term, where in unknowns.cells.items():
        deviations[where] = known[term]
    if 'friction' in unknowns.terms:
        deviations[-1] = known['friction']
    full = np.diag(np.append(np.zeros(design.N), deviations[design.N :] ** -2))
    full[unknowns.alpha, unknowns.alpha] = np.linalg.inv(spread)
    return full


def alpha_patterns(design: Design) -> Array:
    """Return how alpha changes with the relative changes of stiffness, gamma and beta.

    Shape (3, N). Data cannot distinguish these three from cells that happen to follow them.
    """
    alpha, j = design.alpha, design.sites
    defect = (j % design.J == 0) & (j <= design.N - design.tail)
    gradient = design.gamma * j / (1.0 + design.gamma * j)
    anomaly = design.beta / (1.0 + design.beta) * defect
    return np.asarray(alpha * np.array([np.ones(design.N), gradient, anomaly]))


def free_basis(unknowns: Unknowns, free: str) -> Array:
    """Return a basis of the changes that are free, shape (size, m); see `Stage.free`."""
    if free == 'cells':
        return np.eye(unknowns.size)
    if free == 'rest':
        shown = 'D_s1', 'D_s2', 'zero_left', 'zero_right', 'gain_left', 'gain_right'
        return np.eye(unknowns.size)[:, [unknowns.shared(name) for name in shown]]
    shared = np.zeros((unknowns.size, 3 + len(SHARED_UNKNOWNS)))
    shared[unknowns.alpha, :3] = alpha_patterns(unknowns.design).T
    shared[unknowns.design.N : unknowns.shared_end, 3:] = np.eye(len(SHARED_UNKNOWNS))
    return shared


MAX_MISFIT_PER_DATUM = 1.1
"""Largest misfit per datum of a model that describes the element."""

WHOLE_WINDOW = 1e9
"""A window as long as the record."""

ZERO_DRIFT_CELLS = 1e-4
"""Standard deviation of a transducer's zero from shot to shot in cells, as long as it is not
known."""

MIN_ZERO_DRIFT_CELLS = 1e-5
"""Least standard deviation of a zero that is believed, in cells."""


class Normal(NamedTuple):
    """The normal equations of a linearised misfit.

    Attributes:
        H: J^T J with the residuals in standard deviations, shape (m, m).
        g: J^T r, shape (m,).
        cost: r^T r.
        data: Number of residuals.
        loosened: What gains that may drift take from the logarithm of the evidence, twice.
    """

    H: Array
    g: Array
    cost: float
    data: int
    loosened: float = 0.0


class ShotResiduals(NamedTuple):
    """A shot beside its prediction.

    Attributes:
        values: Residuals in standard deviations, shape (2, m).
        weights: Of every sample, the inverse of its standard deviation, shape (2, m).
        drifts: See `Misfit._drift_changes`.
        loosened: See `Normal`.
    """

    values: Array
    weights: Array
    drifts: Array
    loosened: float


class Slopes(NamedTuple):
    """Derivatives of every shot by all unknowns: they hold near where they were taken.

    Attributes:
        window: Time after the pulses up to which there are any.
        shared: Whether they are those of `free_basis(..., 'shared')` alone.
        each: By shot, shape (2, m, size).
    """

    window: float
    shared: bool
    each: tuple[Single, ...]

    def select_unknowns(self, unknowns: NDArray[np.int64]) -> Slopes:
        """Return those by some unknowns alone."""
        return self._replace(each=tuple(J[..., unknowns] for J in self.each))


@dataclass(frozen=True, eq=False)
class Misfit:
    """Shots, and what is to be found from them.

    Attributes:
        prior: See `PRIOR_DEVIATIONS`.
        simulated: Whether the element is simulated, so that its steps are repeated.
        drift: Standard deviation of a transducer's zero from shot to shot.
        gain_drift: Standard deviation of its gain from shot to shot, relative.
        scatter: Standard deviations that the data show, in place of those of the prior.
    """

    unknowns: Unknowns
    shots: Sequence[Shot]
    prior: Mapping[str, float] = field(default_factory=lambda: PRIOR_DEVIATIONS)
    simulated: bool = False
    drift: float = ZERO_DRIFT_CELLS
    gain_drift: float = 0.0
    scatter: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def _latest_forward(self) -> list[Forward]:
        return []

    @cached_property
    def precision(self) -> Array:
        """The inverse of the prior's covariance, shape (size, size)."""
        return prior_precision(self.unknowns, {**self.prior, **self.scatter})

    def forward(self, x: Array) -> Forward:
        """Return the forward model with these values, the same one as long as they are asked for;
        raises as `Forward` does.
        """
        if not (self._latest_forward and self._latest_forward[0].x is x):
            self._latest_forward[:] = [Forward(self.unknowns, x, self.simulated)]
        return self._latest_forward[0]

    def predict_shot(self, x: Array, shot: Shot, window: float) -> Array:
        """Return what both ends read at rest, then until a window after the pulse has passed,
        shape (2, m); raises as `Forward` and `Forward.predict` do.
        """
        return self.forward(x).predict(shot, shot.pulse.duration + window)

    def compare_shot(
        self, x: Array, shot: Shot, window: float, blur: float = 0.0
    ) -> ShotResiduals:
        """Return residuals of `predict_shot`.

        Args:
            blur: Standard deviation of a sample if it is larger than the noise: residuals of a
                model that is still far off are smoothed so.
        """
        predicted = self.predict_shot(x, shot, window)
        stride = Clock.of(shot.dt, self.simulated).stride
        measured = shot.samples[:, stride - 1 :: stride][:, : predicted.shape[1] - 1]
        measured = np.concatenate((shot.rest[:, None], measured), axis=1)
        spread = np.maximum(estimate_noise(shot), blur)[:, None] * np.ones_like(measured)
        spread[:, 0] = max(self.drift, blur)
        weights = np.where(np.isfinite(measured), 1.0 / spread, 0.0)
        misfit = np.where(weights > 0.0, predicted - measured, 0.0)
        drifts = self._drift_changes(x, shot, window, weights)
        values, loosened = _loosen_gains(self.whiten_residuals(shot, misfit, weights), drifts)
        loosened = 4.0 * math.log(self.drift / MIN_ZERO_DRIFT_CELLS) + loosened
        return ShotResiduals(values, weights, drifts, loosened)

    def whiten_residuals(self, shot: Shot, waveforms: Array | Single, weights: Array) -> Array:
        """Return what a shot tells of waveforms, (2, m, ...), in standard deviations."""
        return whiten_waveforms(waveforms, weights, self._count_held_samples(shot))

    def _count_held_samples(self, shot: Shot) -> int:
        """Return for how many compared samples an end is held."""
        stride = Clock.of(shot.dt, self.simulated).stride
        return math.ceil(shot.pulse.duration / (shot.dt * stride))

    def _drift_changes(self, x: Array, shot: Shot, window: float, weights: Array) -> Array:
        """Return what gains that drift change by a standard deviation each, shape (k, 2, m).

        They are the gain of either sensor, its rest included; its slope; the gain of the pulse,
        which changes the waves at both ends; and where the driven end is held: its gain has
        drifted since its rest was measured. Shots are independent: those of a slow drift are not,
        but a model of that is wrong of a quick one, and this is right of both.
        """
        predicted = self.predict_shot(x, shot, window)
        if not self.gain_drift:
            return np.zeros((0, *predicted.shape))
        heard = self.whiten_residuals(shot, predicted, weights)
        # standard deviation of where an end is held from where it rests in cells, if gains drift
        held_end_deviation = 1e-4
        moved = (
            self.forward(x).predict(shot, shot.pulse.duration + window, held_end_deviation)
            - predicted
        )
        changes = np.zeros((6, *heard.shape))
        changes[0, 0], changes[1, 1], changes[2, :, 1:] = heard[0], heard[1], heard[:, 1:]
        # how far a gain drifts during half a pulse, over how far it drifts from shot to shot: the
        # element rests for some ten times as long in between
        pulse_drift_ratio = 0.1
        changes[3:5] = pulse_drift_ratio * np.linspace(-1.0, 1.0, heard.shape[1]) * changes[:2]
        changes[:5] *= self.gain_drift
        changes[5] = self.whiten_residuals(shot, moved, weights)
        return changes

    def with_drift(self, x: Array) -> Misfit:
        """Return this misfit with the drift that the displacements at rest show.

        If gains drift, these move them, and of their zeros no more is known.
        """
        if self.gain_drift:
            return replace(self, drift=ZERO_DRIFT_CELLS)
        each = [self.predict_shot(x, shot, -WHOLE_WINDOW)[:, 0] - shot.rest for shot in self.shots]
        shown = free_basis(self.unknowns, 'rest').shape[1]  # unknowns that they determine
        free = max(1, 2 * len(each) - shown)
        found = float(np.sqrt(np.sum(np.square(each)) / free))
        return replace(self, drift=max(found, MIN_ZERO_DRIFT_CELLS))

    def select_shots(self, shots: Sequence[Shot]) -> Misfit:
        """Return the misfit of other shots."""
        return replace(self, shots=tuple(shots))

    def cost(
        self, x: Array, window: float, blur: float = 0.0, shots: Sequence[Shot] | None = None
    ) -> float:
        """Return r^T r over a window after the pulses of some shots, by default of all; infinite
        where there is no such element.
        """
        shots = self.shots if shots is None else shots
        try:
            each = (self.compare_shot(x, shot, window, blur).values for shot in shots)
            return float(sum(np.sum(values**2) for values in each))
        except (DesignError, StateError):
            return np.inf

    def slopes(self, x: Array, window: float, shared: bool = False) -> Slopes:
        """Return the derivatives of every shot; raises as `Forward.linearise_shot` does."""
        along = alpha_patterns(self.unknowns.design) if shared else NO_PATTERNS
        each = (
            self.forward(x).linearise_shot(shot, shot.pulse.duration + window, along)
            for shot in self.shots
        )
        return Slopes(window, shared, tuple(each))

    def linearise_shots(
        self, x: Array, window: float, blur: float = 0.0, slopes: Slopes | None = None
    ) -> Iterator[tuple[ShotResiduals, Array]]:
        """Yield of every shot its residuals and their derivatives in standard deviations, shape
        (2, m, size); raises as `Forward.linearise_shot` does.

        Args:
            window: How long after its pulse each shot is compared.
            blur: Least standard deviation of a sample.
        """
        for shot, J in zip(self.shots, (slopes or self.slopes(x, window)).each, strict=True):
            found = self.compare_shot(x, shot, window, blur)
            own = self.whiten_residuals(shot, J[:, : found.values.shape[1]], found.weights)
            yield found, _loosen_gains(own, found.drifts)[0]

    def iterate_normals(
        self, x: Array, window: float, blur: float = 0.0, slopes: Slopes | None = None
    ) -> Iterator[Normal]:
        """Yield the normal equations of every shot; see `linearise_shots`."""
        for found, own in self.linearise_shots(x, window, blur, slopes):
            flat, cost = own.reshape(-1, own.shape[-1]), float(np.sum(found.values**2))
            data = int(np.count_nonzero(found.weights))
            yield Normal(flat.T @ flat, flat.T @ found.values.ravel(), cost, data, found.loosened)

    def normal(
        self, x: Array, window: float, blur: float = 0.0, slopes: Slopes | None = None,
        near: Normal | None = None,
    ) -> Normal:  # fmt: skip
        """Return the normal equations of all shots; see `iterate_normals`. `near` are those of a
        place near x with the same derivatives: H is taken from there.
        """
        if near is not None and slopes is not None:
            return self._shift_normals(x, window, blur, slopes, near)
        each = zip(*self.iterate_normals(x, window, blur, slopes), strict=True)
        return Normal._make(map(sum, each))

    def _shift_normals(
        self, x: Array, window: float, blur: float, slopes: Slopes, near: Normal
    ) -> Normal:
        """Return normal equations with another g and cost: what is done to weighted waveforms is
        symmetric, and done to residuals twice leaves the derivatives as they are.
        """
        g, cost = np.zeros(len(near.g)), 0.0
        for shot, J in zip(self.shots, slopes.each, strict=True):
            residual, weights, drifts, _ = self.compare_shot(x, shot, window, blur)
            cost += float(np.sum(residual**2))
            twice = _loosen_gains(residual, drifts)[0][..., None]
            twice = weights * remove_lines(twice, weights, self._count_held_samples(shot))[..., 0]
            for of_end, J_of_end in zip(twice.astype(np.float32), J, strict=True):
                g += of_end @ J_of_end[: len(of_end)]
        return near._replace(g=g, cost=cost)


def _loosen_gains(values: Array, drifts: Array) -> tuple[Array, float]:
    """Return whitened values, (2, m, ...), where gains may be others than before.

    To integrate over `Misfit._drift_changes` takes most of their directions out of the values,
    in place. The second number is twice what that costs in the logarithm of the evidence.
    """
    if not len(drifts):
        return values, 0.0
    way, size, _ = np.linalg.svd(drifts.reshape(len(drifts), -1).T, full_matrices=False)
    wide = 1.0 + size**2
    flat = values.reshape(drifts[0].size, -1)
    flat -= (way * (1.0 - wide**-0.5)) @ (way.T @ flat)
    return flat.reshape(values.shape), float(np.sum(np.log(wide)))
