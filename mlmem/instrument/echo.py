# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Echo detection: the carrier filter, v_m, its moving average v_c, and the first crossing of the
threshold.

Both ends listen at the same time. A wall reflects nearly all of either pulse, but the left end's
threshold is so low that it would hear what passes of the right end's. The carriers differ by a
factor of three, so a cosine under a Gaussian separates them: the filter passes the pulse of one
end, and nothing slower or of the other end. It also removes sensor noise, a shaken base, and the
swinging of all cells in phase that a strain leaves behind.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..physics import Design
from ..physics.formulas import cosine, exponential
from ..physics.jit import compile_kernel
from ..physics.values import Array
from ..physics.waves import group_velocity
from .end import End, PulseShape, Shot

if TYPE_CHECKING:
    from ..settings import ProbeSettings


def compute_weights(probe: ProbeSettings, dt: float) -> Array:
    """Return the weights of the filter for samples dt apart, shape (2n + 1,), symmetric.

    They pass the carrier unchanged and remove a constant.
    """
    # The Gaussian of one carrier period passes 0.2 % of 0.43 of the carrier. It is cut off at
    # four standard deviations, where it has fallen to 0.03 %.
    sigma = 2.0 * math.pi / probe.omega_c
    n = math.ceil(4.0 * sigma / dt)
    t: Array = dt * np.arange(-n, n + 1, dtype=np.float64)
    envelope = exponential(-0.5 * (t / sigma) ** 2)
    wave = cosine(probe.omega_c * t)
    wave = envelope * (wave - (envelope * wave).sum() / envelope.sum())
    return np.asarray(wave / (wave * cosine(probe.omega_c * t)).sum())


def filter_carrier(v: Array, weights: Array) -> Array:
    """Return the carrier's part of displacements, shape (m,), for v of shape (m + 2n,).

    It is in phase with v[n:-n].
    """
    passed = np.zeros(max(0, len(v) - len(weights) + 1))
    _apply_filter(v, weights, passed)
    return passed


def carrier_amplitudes(v: Array, weights: Array, ticks: int) -> list[float]:
    """Return the mean magnitude of the carrier's part in each of some ticks.

    `v` has shape (m ticks + 2n,), with m samples in a tick.
    """
    magnitudes = np.abs(filter_carrier(v, weights)).reshape(ticks, -1)
    means: list[float] = (np.add.reduce(magnitudes, axis=1) / magnitudes.shape[1]).tolist()
    return means


@compile_kernel
def _apply_filter(v: Array, weights: Array, passed: Array) -> None:
    """Add weight by weight, so that the bits do not depend on how many samples come at once."""
    for k in range(len(weights)):
        weight = weights[k]
        for i in range(len(passed)):
            passed[i] += weight * v[i + k]


def window_width(probe: ProbeSettings) -> float:
    """Return the width of the averaging window; T = 16 pi / omega_c on page 5: 8 periods."""
    return 2.0 * math.pi * probe.window / probe.omega_c


def pulse_duration(probe: PulseShape) -> float:
    """Return 2 t_0 = 12 sigma, the time the boundary is driven."""
    return 12.0 * probe.sigma


def blanking_time(probe: ProbeSettings) -> float:
    """Return the time from which to look for echoes: the window is clear of the pulse."""
    return pulse_duration(probe) + 0.5 * window_width(probe)


def earliest_delay(probe: ProbeSettings) -> float:
    """Return the time up to which a crossing says no more than that it came before."""
    return blanking_time(probe) + 0.6  # the first sample is taken within 0.6 time units


def is_hidden(probe: ProbeSettings, delay: float) -> bool:
    """Whether an echo begins before listening does: then its delay says no more than that."""
    return delay <= earliest_delay(probe)


def listening_time(design: Design, probe: ProbeSettings, end: End) -> float:
    """Return the longest time of an echo: there and back over the whole element, plus its tail."""
    # least group velocity, in cells per time unit, that the listening time allows for
    speed = max(0.15, float(group_velocity(probe.omega_c, end.k_s(design))))
    return pulse_duration(probe) + 2.0 * design.N / speed + ECHO_TAIL_TIME


ECHO_TAIL_TIME = 150.0
"""Time units that a read listens after the first crossing, for the echo's peak."""

Crossings = tuple[float | None, float, float | None]
"""Times at which an echo crosses a share of the threshold, the threshold, and the other share."""

Shape = tuple[float | None, float | None, float]
"""Times at which an echo crosses 0.8 and 1.25 of the threshold, None where it does not; and its
greatest v_c over the threshold. One from afar rises in bumps, and may just reach the threshold at
one time and just miss it at another; not three thresholds at once."""

MIN_THRESHOLD_CELLS = 1e-13
"""Least threshold in cells: the rounding noise of an end that rests near 0."""


def detection_threshold(
    probe: ProbeSettings, t: Array, floor: float = 0.0, least: float = MIN_THRESHOLD_CELLS
) -> Array:
    """Return the threshold of v_c at times t since the pulse began, v_th exp(-gain_decay t).

    On-site damping makes every wave decay as exp(-eta t / 2), echoes as well as the ring-down of
    the pulse; the threshold decays with them. Sensor noise does not decay and adds to v_c in
    quadrature. It is added to the threshold in the same way, so that an echo crosses at about the
    same time as without noise. Nothing is detected below the rounding noise of a resting end.

    Args:
        probe: The detector's settings.
        t: Times.
        floor: Contribution of noise alone to v_c, in cells.
        least: Lower bound, in cells.
    """
    plain = np.maximum(probe.v_th * exponential(-probe.gain_decay * t), least)
    return np.sqrt(plain * plain + floor * floor) if floor else plain


@dataclass(frozen=True)
class Echo:
    """The response to a probe.

    Attributes:
        t: Times since the pulse began, shape (n,).
        v_m: Magnitude of the carrier's part of v - rest, shape (n,).
        v_c: v_m averaged over a centred window of width T, shape (n,).
        delay: Time of the first crossing of the threshold, or None without an echo.
        threshold_margin: Greatest v_c over the threshold: above 1 for an echo.
        floor: Contribution of noise and vibration alone to v_c.
        shaken: Whether the base shook.
        spoiled: Whether it began to shake after the pulse, so that its contribution is not known.
        shot: The pulse and what both ends did after it, whatever else was fired; None if it was
            not recorded. Its wall is not known.
    """

    end: End
    probe: ProbeSettings
    t: Array
    v_m: Array
    v_c: Array
    delay: float | None
    threshold_margin: float
    floor: float = 0.0
    shaken: bool = False
    spoiled: bool = False
    shot: Shot | None = None

    @property
    def is_early(self) -> bool:
        """Whether the threshold was already crossed when listening began."""
        return self.delay is not None and is_hidden(self.probe, self.delay)

    @cached_property
    def _received(self) -> tuple[Array, Array, Array]:
        """Times from when listening begins on, v_c then, and the threshold."""
        begin = int(np.searchsorted(self.t, blanking_time(self.probe), side='right'))
        t = self.t[begin:]
        return t, self.v_c[begin:], detection_threshold(self.probe, t, self.floor)

    @cached_property
    def shape(self) -> Shape:
        """When it crosses 0.8 and 1.25 of the threshold, and how loud it is."""
        t, v_c, whole = self._received
        over = [v_c > share * whole for share in (0.8, 1.25)]
        low, high = (float(t[np.argmax(each)]) if each.any() else None for each in over)
        return low, high, self.threshold_margin

    def measure_amplitude(self, until: float) -> float:
        """Return the greatest v_c over the threshold up to a time; 0 if nothing was received."""
        t, v_c, whole = self._received
        n = int(np.searchsorted(t, until, side='right'))
        return float((v_c[:n] / whole[:n]).max(initial=0.0))

    @property
    def threshold_factor(self) -> float:
        """Factor by which noise raised the threshold at the delay, or at the last sample; >= 1."""
        if self.floor == 0.0:
            return 1.0
        t = np.array(self.delay if self.delay is not None else self.t[-1])
        return float(
            detection_threshold(self.probe, t, self.floor) / detection_threshold(self.probe, t)
        )


class EchoDetector:
    """Detects an echo sample by sample.

    Attributes:
        delay: Time of the first crossing so far, or None.
        threshold_margin: Greatest v_c over the threshold so far.
        time: Time up to which v_c is known.
    """

    def __init__(
        self,
        probe: ProbeSettings,
        dt: float,
        floor: float = 0.0,
        least: float = MIN_THRESHOLD_CELLS,
        past: Array | None = None,
        *,
        filtered: bool = True,
    ) -> None:
        """Prepare for the samples of a pulse that begins now.

        Args:
            dt: Sampling interval; the first sample is at dt.
            floor: Contribution of noise alone to v_c, which raises the threshold.
            least: Lower bound of the threshold: the contribution of rounding.
            past: Displacements from rest before, newest last; by default at rest.
            filtered: Whether only the carrier is heard; otherwise, as in the paper, all.
        """
        self._floor = floor
        self._least = least
        self.probe = probe
        self.delay: float | None = None
        self.threshold_margin = 0.0
        self._dt = dt
        self._half = max(1, round(0.5 * window_width(probe) / dt))
        self._weights = compute_weights(probe, dt) if filtered else np.ones(1)
        n = len(self._weights) // 2
        known = np.zeros(n) if past is None else past[max(0, len(past) - n) :]
        self._past = np.concatenate((np.zeros(n - len(known)), known))
        self._v_m = np.zeros(0)
        self._sums = np.zeros(1)
        self._v_c = np.zeros(0)

    @property
    def time(self) -> float:
        """Time up to which v_c is known."""
        return len(self._v_c) * self._dt

    def find_loudest(self, duration: float, ago: float = 0.0) -> float:
        """Return the greatest v_c in an interval that ended some time ago; 0 if nothing was
        received.
        """
        n, last = round(duration / self._dt), len(self._v_c) - round(ago / self._dt)
        return float(self._v_c[max(0, last - n) : max(0, last)].max(initial=0.0))

    def feed_displacements(self, v: Array) -> None:
        """Take displacements from rest, shape (n,), and look for a threshold crossing.

        The bits do not depend on how many come at once.
        """
        known = np.concatenate((self._past, v))
        self._past = known[len(known) - min(len(known), len(self._weights) - 1) :]
        v_m = np.abs(filter_carrier(known, self._weights))
        self._v_m = np.concatenate((self._v_m, v_m))
        self._sums = np.concatenate((self._sums, v_m))
        first, last = len(self._v_c), max(len(self._v_c), len(self._v_m) - self._half)
        self._v_c = np.concatenate((self._v_c, np.empty(last - first)))
        _average_window(self._sums, len(v_m), self._half, self._v_c, first)
        self._find_crossing(first)

    def _find_crossing(self, first: int) -> None:
        """Look for a crossing in v_c from a sample on."""
        t = np.arange(first + 1.0, len(self._v_c) + 1.0) * self._dt
        deaf = int(np.searchsorted(t, blanking_time(self.probe), side='right'))
        t, v_c = t[deaf:], self._v_c[first + deaf :]
        if not len(t):
            return
        ratio = v_c / detection_threshold(self.probe, t, self._floor, self._least)
        self.threshold_margin = max(self.threshold_margin, float(ratio.max()))
        if self.delay is None and (over := ratio > 1.0).any():
            self.delay = float(t[over.argmax()])

    def raise_noise_floor(self, floor: float) -> None:
        """Judge everything again with the noise that is measured now, if it has become louder."""
        if floor > self._floor:
            self._floor, self.delay, self.threshold_margin = floor, None, 0.0
            self._find_crossing(0)

    def build_echo(
        self, end: End, shot: Shot | None = None, *, shaken: bool = False, spoiled: bool = False
    ) -> Echo:
        """Return everything received at an end, up to the time where v_c is known."""
        n = len(self._v_c)
        t = np.arange(1.0, n + 1.0) * self._dt
        return Echo(
            end, self.probe, t, self._v_m[:n], self._v_c, self.delay, self.threshold_margin,
            self._floor, shaken, spoiled, shot,
        )  # fmt: skip


@compile_kernel
def _average_window(sums: Array, new: int, half: int, v_c: Array, first: int) -> None:
    """Average v_m over a centred window.

    Args:
        v_c: Out: the averages, from a sample on.
    """
    for i in range(len(sums) - new, len(sums)):
        sums[i] += sums[i - 1]
    for i in range(first, len(v_c)):
        v_c[i] = (sums[i + half + 1] - sums[max(i - half, 0)]) / (2 * half + 1)
