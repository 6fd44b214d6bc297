# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is not known of the nine lattices, as distributions: from force curves to speeds.

The law of a rail is a mixture of its force tests. A lattice has a tilt of its own, a constant
force that stands for mounting, weight and the zero of the machine; tilts of a rail scatter about
its mean. The hand of each lattice, damping and the loss in the snap are unknown, and the magnets
to 5 %. Speeds and rises of the measured waves, and the two silences, are the data.

The posterior is sampled by tempering: particles of the prior see more and more of the data, and
are moved by Metropolis steps, unknowns of one lattice, of one rail, or common ones at a time, as
only these waves change (Del Moral, Doucet & Jasra, J. R. Stat. Soc. B 68, 411, 2006). To leave a
lattice out is to sample without its data, and to draw its own unknowns afresh.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from mlmem.physics.values import Array

from .runs import ALL_CASES, SILENT_CASES, Case, load_runs
from .shells import TESTS_BY_RAIL, Chains, launch_waves, load_force_table


@dataclass
class Particles:
    """Draws of all unknowns, and what follows from them.

    Attributes:
        common: See `Model.PRIOR_MEAN`, shape (n, 4).
        shares: Logits of the force tests of each rail, (n, 3, 3); those of no test are -inf.
        mean: Mean tilt of each rail, 10 N, (n, 3).
        tilt, hand, well: Of each lattice: 10 N, logarithm of ms, cm, shape (n, 9).
        speed, rise, passed: Of its waves (see `launch_waves`), (n, 9).
    """

    common: Array
    shares: Array
    mean: Array
    tilt: Array
    hand: Array
    well: Array
    speed: Array
    rise: Array
    passed: Array

    def select_particles(self, which: Array) -> Particles:
        """Return those of some numbers."""
        return Particles(*(each[which] for each in vars(self).values()))

    def share_laws(self, rail: int) -> Array:
        """Return the shares of a rail's force tests, (n, 3)."""
        weights = np.exp(self.shares[:, rail] - self.shares[:, rail].max(axis=1, keepdims=True))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def build_chains(self, case: int) -> Chains:
        """Return their chains of a lattice."""
        rail = case // 3
        tables = [load_force_table(name) for name in TESTS_BY_RAIL[ALL_CASES[case].rail]]
        weights = self.share_laws(rail)[:, : len(tables)]
        own = np.array([well for _, well in tables])
        well = self.well[:, case]
        stretch = (well / (weights @ own))[:, None] ** 1.5
        common = self.common.T
        return Chains(
            laws=stretch * (weights @ np.array([force for force, _ in tables])),
            well=well,
            spacing=np.full_like(well, ALL_CASES[case].spacing),
            tilt=self.tilt[:, case],
            damping=np.exp(common[0]),
            snap=np.exp(common[1]),
            magnets=np.exp(common[2]),
            hand=np.exp(self.hand[:, case]),
        )

    def run_waves(self, cases: Sequence[int]) -> None:
        """Find the waves of some lattices."""
        for case in cases:
            found = launch_waves(self.build_chains(case))
            for own, each in zip((self.speed, self.rise, self.passed), found, strict=True):
                own[:, case] = each


@dataclass(frozen=True)
class Measurement:
    """What was measured of a lattice: speed (m/s) and rise (ms), NaN for silence; its well, cm."""

    speed: float
    rise: float
    well: float


def mean_measurement(case: Case) -> Measurement:
    """Return the means over the runs of a lattice; of a silent one the rail's mean well."""
    if case in SILENT_CASES:
        others = [Case(case.rail, spacing) for spacing in (6.0, 8.0)]
        return Measurement(
            np.nan, np.nan, float(np.mean([mean_measurement(other).well for other in others]))
        )
    found = load_runs(case)
    return Measurement(
        float(np.exp(np.mean([np.log(run.speed) for run in found]))),
        float(np.exp(np.nanmean([np.log(run.rise_times) for run in found]))),
        float(np.mean([run.rest_positions.mean() for run in found])),
    )


class Model:
    """Prior and likelihood, and moves that leave the posterior as it is."""

    PRIOR_MEAN = np.array([np.log(0.012), np.log(0.02), 0.0, 0.0])
    PRIOR_WIDTH = np.array([0.7, 1.0, 0.05, 0.005])
    """Priors of the common unknowns: logarithms of damping and damping of the snap (per ms),
    logarithm of the factor of the magnets, scatter of the tilts (10 N), which is the upper half of
    a normal."""

    TILT_WIDTH = 0.01
    """Width of a rail's mean tilt, 10 N: 0.1 N is half the weight of an element."""

    HAND_TIME_BOUNDS_MS = 10.0, 100.0
    """Shortest and longest time of the hand, ms; its logarithm is uniform."""

    WELL_DEVIATION_CM = 0.2
    """Uncertainty of the second well where no wave has shown it, cm."""

    def __init__(self, rng: np.random.Generator, snap: bool) -> None:
        """Take viscous damping, and with `snap` a loss in the snap beside it."""
        self.rng, self.free = rng, np.array([True, snap, True, True])
        self.data = [mean_measurement(case) for case in ALL_CASES]

    def draw_prior(self, n: int) -> Particles:
        """Return particles of the prior, with their waves."""
        normal = self.rng.standard_normal
        common = self.PRIOR_MEAN + self.PRIOR_WIDTH * normal((n, len(self.PRIOR_MEAN)))
        common[:, 3] = np.abs(common[:, 3])
        common[:, ~self.free] = -99.0  # the logarithm of no loss
        shares = normal((n, 3, 3))
        shares[:, 2, 2] = -np.inf
        mean = self.TILT_WIDTH * normal((n, 3))
        new = Particles(common, shares, mean, *np.zeros((6, n, 9)))
        for case in range(9):
            self._refresh_unknowns(new, case)
        new.run_waves(range(9))
        return new

    def _refresh_unknowns(self, at: Particles, case: int) -> None:
        """Draw the unknowns of a lattice of their prior."""
        n, normal = len(at.tilt), self.rng.standard_normal
        low, high = np.log(self.HAND_TIME_BOUNDS_MS)
        at.tilt[:, case] = at.mean[:, case // 3] + at.common[:, 3] * normal(n)
        at.hand[:, case] = self.rng.uniform(low, high, n)
        at.well[:, case] = self.data[case].well
        if ALL_CASES[case] in SILENT_CASES:
            at.well[:, case] += self.WELL_DEVIATION_CM * normal(n)

    def predict_speeds(self, at: Particles, case: int, draws: int = 20) -> Array:
        """Return speeds of a lattice whose own unknowns are drawn afresh, NaN for silence.

        Shape (draws, n).
        """
        speeds = []
        for _ in range(draws):
            self._refresh_unknowns(at, case)
            at.run_waves([case])
            speeds.append(at.speed[:, case].copy())
        return np.array(speeds)

    def compute_log_prior(self, at: Particles) -> Array:
        """Return the logarithm of the prior density, up to a constant, shape (n,)."""
        z = (at.common - self.PRIOR_MEAN) / self.PRIOR_WIDTH
        found = -0.5 * (z[:, self.free] ** 2).sum(axis=1)
        found -= 0.5 * (np.where(np.isfinite(at.shares), at.shares, 0.0) ** 2).sum(axis=(1, 2))
        found -= 0.5 * ((at.mean / self.TILT_WIDTH) ** 2).sum(axis=1)
        spread = at.common[:, 3:]
        with np.errstate(all='ignore'):
            off = (at.tilt - np.repeat(at.mean, 3, axis=1)) / spread
            found -= 0.5 * (off**2).sum(axis=1) + 9.0 * np.log(spread[:, 0])
        for case in map(ALL_CASES.index, SILENT_CASES):
            off_well = at.well[:, case] - self.data[case].well
            found -= 0.5 * (off_well / self.WELL_DEVIATION_CM) ** 2
        low, high = np.log(self.HAND_TIME_BOUNDS_MS)
        bad = (at.hand < low).any(axis=1) | (at.hand > high).any(axis=1)
        bad |= at.common[:, 3] < 0.0
        return np.asarray(np.where(bad, -np.inf, found))

    def log_likelihood(self, at: Particles) -> Array:
        """Return the logarithm of the likelihood of each lattice, (n, 9)."""
        found = np.zeros_like(at.speed)
        # relative: two runs of one lattice differ by 5.3 %, and elements are not alike
        speed_error = 0.06
        rise_error = 0.2  # of a rise, relative: those of the four elements differ by as much
        passes_silence = 0.02  # likelihood that a wave was missed
        # logarithm of the likelihood of a wave that stops, and for each element that it lacks
        stop_log_likelihoods = -20.0, -3.0
        for case, data in enumerate(self.data):
            passes = np.isfinite(at.speed[:, case])
            if np.isnan(data.speed):
                found[:, case] = np.where(passes, np.log(passes_silence), 0.0)
                continue
            speed = np.log(at.speed[:, case] / data.speed) / speed_error
            rise = np.log(at.rise[:, case] / data.rise) / rise_error
            stopped = stop_log_likelihoods[0] + stop_log_likelihoods[1] * (
                11.0 - at.passed[:, case]
            )
            rise = np.where(np.isfinite(rise), rise, 3.0)
            found[:, case] = np.where(passes, -0.5 * (speed**2 + rise**2), stopped)
            found[:, case] = np.maximum(found[:, case], stopped.min())
        return found

    # --- moves ---------------------------------------------------------------------------

    def move_particles(self, at: Particles, weight: Array) -> None:
        """Move all particles once, of data with a weight per lattice."""
        for size in (0.3, 1.0):
            self._try_change(at, weight, partial(self._propose_common, size=size), range(9))
        for rail in range(3):
            shares = partial(self._propose_shares, rail=rail)
            self._try_change(at, weight, shares, range(3 * rail, 3 * rail + 3))
        for case in range(9):
            self._try_change(at, weight, partial(self._propose_lattice, case=case), [case])
        for _ in range(5):
            self._try_change(at, weight, self._propose_tilts, [])

    def _try_change(
        self, at: Particles, weight: Array, change: Callable[[Particles], None],
        cases: Sequence[int],
    ) -> None:  # fmt: skip
        """Accept or reject a change of every particle, which changes the waves of some cases."""
        new = Particles(*(each.copy() for each in vars(at).values()))
        change(new)
        before, after = self.compute_log_prior(at), self.compute_log_prior(new)
        legal = np.isfinite(after)
        if cases:
            some = new.select_particles(legal)
            some.run_waves(cases)
            for name in ('speed', 'rise', 'passed'):
                getattr(new, name)[legal] = getattr(some, name)
            before = before + self.log_likelihood(at) @ weight
            after = after + self.log_likelihood(new) @ weight
        with np.errstate(invalid='ignore'):
            take = legal & (np.log(self.rng.uniform(size=len(legal))) < after - before)
        for name, value in vars(at).items():
            value[take] = getattr(new, name)[take]

    def _propose_jump(self, x: Array) -> Array:
        """Return differences of pairs of particles, and a little noise: as wide as they lie."""
        n, d = x.shape
        a, b = (self.rng.integers(n, size=n) for _ in range(2))
        size = np.where(self.rng.uniform(size=(n, 1)) < 0.3, 0.3, 1.0) * 2.38 / np.sqrt(2.0 * d)
        noise = 0.03 * x.std(axis=0) * self.rng.standard_normal((n, d))
        return np.asarray(size * (x[a] - x[b]) + noise)

    def _propose_common(self, new: Particles, size: float) -> None:
        own = np.flatnonzero(self.free[:3])
        new.common[:, own] += size * self._propose_jump(new.common[:, own])

    def _propose_shares(self, new: Particles, rail: int) -> None:
        k = len(TESTS_BY_RAIL[ALL_CASES[3 * rail].rail])
        new.shares[:, rail, :k] += self._propose_jump(new.shares[:, rail, :k])

    def _propose_lattice(self, new: Particles, case: int) -> None:
        names = ['tilt', 'hand', *(['well'] if ALL_CASES[case] in SILENT_CASES else [])]
        columns = np.array([getattr(new, name)[:, case] for name in names]).T
        for name, jump in zip(names, self._propose_jump(columns).T, strict=True):
            getattr(new, name)[:, case] += jump

    def _propose_tilts(self, new: Particles) -> None:
        both = self._propose_jump(np.column_stack((new.mean, new.common[:, 3])))
        new.mean += both[:, :3]
        new.common[:, 3] += both[:, 3]

    # --- tempering -----------------------------------------------------------------------

    def sample_posterior(self, n: int, without: int | None = None) -> Particles:
        """Return particles of the posterior, of all lattices or without the data of one."""
        at, weight, done = self.draw_prior(n), np.ones(9), 0.0
        if without is not None:
            weight[without] = 0.0
        while done < 1.0:
            gain = self.log_likelihood(at) @ weight
            step = _largest_step(gain, 1.0 - done)
            done = 1.0 if step >= 1.0 - done else done + step
            w = np.exp(step * (gain - gain.max()))
            at = at.select_particles(_resample_particles(w / w.sum(), self.rng))
            for _ in range(5 if done == 1.0 else 1):
                self.move_particles(at, done * weight)
        return at


def _largest_step(gain: Array, most: float) -> float:
    """Return the step at which half of the particles still count."""

    def effective_size(step: float) -> float:
        w = np.exp(step * (gain - gain.max()))
        return float(w.sum() ** 2 / (w**2).sum())

    if effective_size(most) >= 0.5 * len(gain):
        return most
    low, high = 0.0, most
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective_size(middle) > 0.5 * len(gain) else (low, middle)
    return max(low, 1e-6)


def _resample_particles(weights: Array, rng: np.random.Generator) -> Array:
    """Return numbers of particles, systematically resampled."""
    n = len(weights)
    at = (np.arange(n) + rng.uniform()) / n
    return np.minimum(np.searchsorted(np.cumsum(weights), at), n - 1)
