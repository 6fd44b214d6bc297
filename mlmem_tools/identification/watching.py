# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A twin beside its element: every read is compared with its forecast, and a change is placed.

A change of one cell, or of one thing that all cells share, leaves a residual of its own shape in
the waveforms. So does what the fit left open of every cell, each by its own standard deviation:
the whole element may be a little faster or slower than its twin. That is fitted first, with its
prior; of the rest, the change that explains most is told once reads agree on it.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mlmem.element_file import Element
from mlmem.instrument.end import End, Shot
from mlmem.physics import Design, DesignError, StateError
from mlmem.physics.values import Array
from mlmem.procedure_table import PROCEDURES
from mlmem.readers.reading import UNDECODABLE
from mlmem_ros.contract.streams import ReadShot

from .fitted import MIN_DIVISOR
from .forward import MAX_WALL_OFFSET_CELLS, Clock, Forward, find_equilibria
from .noise import estimate_noise, whiten_waveforms
from .unknowns import Unknowns

CHANGE_KINDS: dict[str, tuple[str, str, float]] = {
    'cell': ('cell {} has become {:.2g} % weaker', 'cell {} has become {:.2g} % stiffer', 0.01),
    'eta': ('damping has fallen by {1:.2g} %', 'damping has risen by {1:.2g} %', 0.05),
    'strain': (
        'the strain is {1:.2g} % below what it should be', 'the strain is {1:.2g} % too high', 5e-4
    ),
    'time_unit': ('the clock is {1:.2g} % faster', 'the clock is {1:.2g} % slower', 0.001),
    **{
        f'{name}_{end}': (
            f'the {end} {part} has fallen by {{1:.2g}} %',
            f'the {end} {part} has risen by {{1:.2g}} %',
            0.01,
        )
        for name, part in (('gain', 'gain'), ('drive', 'pulse'))
        for end in End
    },
}  # fmt: skip
"""What may change, by the name of the unknown: words for a decrease and an increase, with gaps for
its place and its size in per cent; and the least change that matters, relative, or of the strain:
a fit leaves smaller ones open. A gain is that of a transducer, which moves its end by what it
measures; a pulse may be smaller than that."""


@dataclass(frozen=True)
class Change:
    """What has changed since the survey.

    Attributes:
        name: Of `CHANGE_KINDS`.
        site: Site of the cell; 0 for what all cells share.
        amount: Relative change, or that of the strain.
        deviation: Its standard deviation.
    """

    name: str
    site: int
    amount: float
    deviation: float

    def __str__(self) -> str:
        if self.site and abs(self.amount) > 0.3:  # the residual is proportional to smaller changes
            return f'cell {self.site} is not what it was at the survey: stuck, or broken'
        falls, rises, _ = CHANGE_KINDS[self.name]
        words = rises if self.amount > 0.0 else falls
        return f'{words.format(self.site, 100.0 * abs(self.amount))} since the survey'


@dataclass(frozen=True, eq=False)
class Forecast:
    """The waveforms of a read, shape (2, m), and their derivatives by candidates, (2, m, c)."""

    waveforms: Array
    J: Array
    stride: int


def build_forward(element: Element, simulated: bool) -> Forward:
    """Return the forward model of an element in a file; for `simulated` see `Forward`."""
    made = element.specimen
    values = {'masses': made.masses, 'offsets': made.offsets, 'springs': made.k_r}
    nominal = {'masses': 1.0, 'offsets': 0.0, 'springs': 1.0}
    uneven = frozenset(term for term in values if (values[term] != nominal[term]).any())
    unknowns = Unknowns(made.design, uneven)
    x = unknowns.mean
    x[unknowns.alpha] = made.alpha
    for term in uneven:
        x[unknowns.cells[term]] = values[term]
    x[unknowns.shared('time_unit')] = element.time_unit
    for name, ends in vars(element.transducers).items():
        for end, value in zip(('left', 'right'), ends, strict=True):
            x[unknowns.shared(f'{name}_{end}')] = value
    return Forward(unknowns, x, simulated)


@dataclass(frozen=True, eq=False)
class Comparison:
    """A read beside its forecast.

    Attributes:
        chi2: Residual per datum, in standard deviations squared; 1 or less if all is as forecast.
        residual: Root mean square residual of either end in cells, shape (2,).
        wall: Site near which the wall rests, as far as its echo tells; 0 for a blank element.
        change: What explains it, if that is beyond doubt.
    """

    chi2: float
    residual: Array
    wall: float
    change: Change | None = None
    text: str = ''


class _Read(NamedTuple):
    """What a read says of the candidates.

    Attributes:
        z: Of each candidate alone, its size in standard deviations, shape (m,).
        rms: Root mean square residual of either end, shape (2,).
    """

    g: Array
    H: Array
    z: Array
    share: Array
    excess: float
    chi2: float
    rms: Array
    wall: float

    @property
    def is_off_forecast(self) -> bool:
        """Whether the residual, over that of noise and fit, is so large that one which no change
        explains is reported: waves that are left of a write give more in a single read only.
        """
        return self.excess > 8.0


def project_out_prior(g: Array, H: Array, spread: Array) -> tuple[Array, Array, float]:
    """Return normal equations of what remains if the first unknowns are fitted with a prior.

    Args:
        g: J^T r, shape (m,).
        H: J^T J, shape (m, m).
        spread: Standard deviations of the first unknowns about 0 before, shape (n,).

    Returns:
        g of what remains, the diagonal of its H, and by how much the fit lowers r^T r.
    """
    n = len(spread)
    across = spread[:, None] * H[:n]
    inner = np.eye(n) + across[:, :n] * spread
    solved = np.linalg.solve(inner, np.column_stack((across, spread * g[:n])))
    fitted = across.T @ solved[:, -1]
    return (
        g - fitted,
        np.diag(H) - np.sum(across * solved[:, :-1], axis=0),
        float((spread * g[:n]) @ solved[:, -1]),
    )


class Residuals:
    """Compares reads with their forecast; call it from one thread."""

    def __init__(self, element: Element, simulated: bool = False) -> None:
        """Watch an element.

        Args:
            element: The element as fitted.
            simulated: Whether the element is simulated, so that its steps are repeated.
        """
        self.element = element
        self._forward = build_forward(element, simulated)
        self._simulated = simulated
        self._forecasts = dict[tuple[object, ...], Forecast]()
        # the reads in a row that must agree before a change is reported
        self._reads: deque[_Read] = deque(maxlen=2)
        self._N = element.specimen.design.N
        self._places: dict[float, float] = {}
        self._open = np.asarray(element.alpha_std / element.specimen.alpha)

    def was_at_rest(self, shots: Sequence[Shot]) -> bool:
        """Return whether the element was at rest before a read; only then can it be compared."""
        # waves from before the pulse look like a change
        return bool(shots[0].unrest <= 3.0 * estimate_noise(shots[0]).max())

    def compare(self, shots: Sequence[Shot], wall: float) -> Comparison:
        """Compare a read with its forecast.

        Args:
            shots: Its pulses, in their order; their samples end together.
            wall: Site of the defect that holds the wall, 0 for a blank element.

        Raises:
            StateError, DesignError: There is no forecast: the twin holds no such wall.
        """
        read = self._fit_read(shots, self._places.get(wall, wall))
        # a defect may hold the wall at one of several places
        if wall and read.is_off_forecast:
            others = (
                self._fit_read(shots, place)
                for place in find_equilibria(self._forward, shots[0], wall)
                if abs(place - wall) <= MAX_WALL_OFFSET_CELLS
            )
            read = min((read, *others), key=lambda each: each.excess)
            self._places[wall] = read.wall
        self._reads.append(read)
        return Comparison(read.chi2, read.rms, read.wall, *self._judge_reads())

    def _fit_read(self, shots: Sequence[Shot], wall: float) -> _Read:
        """Return what a read says if its wall rests near a site."""
        shots = [replace(shot, wall=wall) for shot in shots]
        forecast, first = self._find_forecast(shots), shots[0]
        every = forecast.stride
        measured = np.concatenate((first.rest[:, None], first.samples[:, every - 1 :: every]), 1)
        m = min(measured.shape[1], forecast.waveforms.shape[1])
        residual = measured[:, :m] - forecast.waveforms[:, :m]
        eta = self._forward.specimen.eta
        fades = np.exp(-0.5 * eta * first.dt * every * np.arange(m))
        white = estimate_noise(first)
        # waves from before the pulse lie in the echo's band, a twentieth of what is sampled
        waves = 5.0 * math.sqrt(max(0.0, first.unrest**2 - (1.1 * white.max()) ** 2))
        spread = np.sqrt(white[:, None] ** 2 + (waves * fades) ** 2)
        weights = np.where(np.isfinite(residual), 1.0 / spread, 0.0)
        weights[:, 0] = 1.0 / 1e-3  # the zero of a transducer may drift by so many cells
        r = whiten_waveforms(np.where(weights > 0.0, residual, 0.0), weights)
        rms = np.sqrt(np.mean((spread * r)[:, 1:] ** 2, axis=1))
        J = whiten_waveforms(forecast.J[:, :m], weights)
        data, cost = max(1, int(np.count_nonzero(weights))), float(np.sum(r**2))
        J = J.reshape(-1, J.shape[2])
        g, H = J.T @ r.ravel(), J.T @ J
        rest, alone, fitted = project_out_prior(g, H, self._open)
        explained = rest**2 / np.maximum(alone, MIN_DIVISOR)
        cost_then = cost - fitted
        trust = 1.0 / max(1.0, (cost_then - explained.max()) / data)  # little if disturbed
        return _Read(
            trust * g, trust * H,
            np.sign(rest) * np.sqrt(trust * explained),
            explained / max(cost_then - data, explained.max(), MIN_DIVISOR),
            cost_then / data, cost / data, rms, wall,
        )  # fmt: skip

    def _find_forecast(self, shots: Sequence[Shot]) -> Forecast:
        """Return the forecast of a read, of the longest so far; the latest are kept."""
        first = shots[0]
        begins = tuple(first.samples.shape[1] - shot.samples.shape[1] for shot in shots)
        pulses = tuple((shot.end, shot.omega_c, shot.A, shot.sigma) for shot in shots)
        key = pulses, begins, first.wall, first.strain
        # at least a time unit apart: the pass bands end well below its Nyquist frequency
        every = max(1, math.floor(1.0 / first.dt))
        known = self._forecasts.pop(key, None)
        if known is None or known.waveforms.shape[1] < 1 + first.samples.shape[1] // every:
            known = self._compute_forecast(shots, every)
        self._forecasts[key] = known
        while len(self._forecasts) > 32:  # each of a megabyte or two
            del self._forecasts[next(iter(self._forecasts))]
        return known

    def _compute_forecast(self, shots: Sequence[Shot], every: int) -> Forecast:
        forward = self._forward
        # later reads may last a quarter longer
        room = np.empty((2, shots[0].samples.shape[1] // 4))
        shots = [replace(s, samples=np.concatenate((s.samples, room), axis=1)) for s in shots]
        first = shots[0]
        duration = first.samples.shape[1] * first.dt
        predicted, J = forward.linearise_exchange(shots, duration)
        strain_step = 1e-5  # strain for a difference quotient
        strained = [replace(shot, strain=shot.strain + strain_step) for shot in shots]
        moved = forward.predict_exchange(strained, duration) - predicted
        clock = Clock.of(first.dt, self._simulated)
        sparse = max(1, every // clock.stride)

        def scale_derivatives(name: str) -> Array:
            place = forward.unknowns.shared(name)
            return np.asarray(J[:, ::sparse, place] * forward.x[place])

        columns = [J[:, ::sparse, forward.unknowns.alpha] * self.element.specimen.alpha]
        for name in list(CHANGE_KINDS)[1:]:
            if name == 'strain':
                column = moved[:, ::sparse] / strain_step
            elif name.startswith('gain_'):  # less motion is driven where more is read
                column = scale_derivatives(name) - scale_derivatives(name.replace('gain', 'drive'))
            else:
                column = scale_derivatives(name)
            columns.append(column[..., None])
        return Forecast(
            predicted[:, ::sparse],
            np.concatenate(columns, axis=2).astype(np.float32),
            sparse * clock.stride,
        )

    def _judge_reads(self) -> tuple[Change | None, str]:
        """Return what has changed, as the last reads agree, and in words."""
        if len(self._reads) != self._reads.maxlen:
            return None, ''
        g, H = (sum(getattr(read, name) for read in self._reads) for name in ('g', 'H'))
        g, alone, _ = project_out_prior(g, H, self._open)
        alone = np.maximum(alone, MIN_DIVISOR)
        best = int(np.argmax(g**2 / alone))
        site = best + 1 if best < self._N else 0
        name = 'cell' if site else list(CHANGE_KINDS)[best - self._N + 1]
        change = Change(name, site, float(g[best] / alone[best]), float(alone[best] ** -0.5))
        *_, least = CHANGE_KINDS[name]
        # standard deviations from which a change is believed, half of it by either read: residuals
        # that are left by a fit, and by its linearisation, reach 7
        min_significance = 10.0
        believed = abs(change.amount) > max(least, min_significance * change.deviation)
        agree = min(
            math.copysign(read.z[best], change.amount * read.z[best]) for read in self._reads
        )
        explains = min(read.share[best] for read in self._reads)
        # or the change is not what has happened
        if believed and agree > min_significance / 2.0 and explains > 0.3:
            return change, str(change)
        if all(read.is_off_forecast for read in self._reads):
            return None, 'the echo is not as forecast, and no single change explains it'
        return None, ''


def locate_wall(design: Design, level: int, known: float | None, moved: bool) -> float | None:
    """Return the cell of the wall that was read, 0 without a wall, or None if it is not known.

    Args:
        level: As decoded; -1 blank, -2 undecodable.
        known: The cell before.
        moved: Whether the wall may be elsewhere by now; otherwise, if the reading does not tell,
            it is where it was.
    """
    if level == UNDECODABLE:
        return None if moved else known
    return float(design.defect_site(level)) if level >= 0 else 0.0


class ResidualMonitor:
    """Takes the waveforms of reads as they come, and compares them once their procedure has ended;
    one thread takes pulses while another compares.

    Attributes:
        text: What has changed, in words; empty as long as all is as forecast.
        compared: Number of reads that were compared.
        skipped: Number of those that were not: disturbed, or too soon after something else.
        last: The last comparison, or None.
    """

    def __init__(self, twin: Element, simulated: bool) -> None:
        """Monitor an element; the arguments are those of `Residuals`."""
        self.twin, self.text = twin, ''
        self.compared = self.skipped = 0
        self.last: Comparison | None = None
        self._residuals = Residuals(twin, simulated)
        self._read: list[ReadShot] = []  # the pulses of one read, which end at the same tick
        self._lock = threading.Lock()
        self._wall: float | None = None

    def take_shot(self, taken: ReadShot) -> None:
        """Take a pulse of a read; one of a later tick begins another read."""
        with self._lock:
            if self._read and self._read[0].tick != taken.tick:
                self.skipped += 1
                self._read = []
            self._read.append(taken)

    def end_procedure(self, name: str) -> None:
        """Compare the last read of a procedure, if it had one."""
        with self._lock:
            read, self._read = self._read, []
        if not read:
            return
        moved = name in PROCEDURES and PROCEDURES[name].changes
        self._wall = locate_wall(self.twin.design, read[-1].level, self._wall, moved)
        shots = sorted((each.shot for each in read), key=lambda shot: -shot.samples.shape[1])
        disturbed = any(each.disturbed for each in read)
        if self._wall is None or disturbed or not self._residuals.was_at_rest(shots):
            self.skipped += 1
            return
        try:
            self.last = self._residuals.compare(shots, self._wall)
        except (StateError, DesignError) as error:
            self.text = f'the twin has no forecast for a wall at {self._wall:.0f}: {error}'
        else:
            self.text = self.last.text
            self.compared += 1
