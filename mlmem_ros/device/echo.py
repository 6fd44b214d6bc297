# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Echo detection: v_m, its moving average v_c, and the first crossing of the threshold."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..physics import Design
from ..physics.dispersion import group_velocity
from ..physics.portable import exponential
from ..physics.potential import Array
from .carrier import carried, half_period
from .end import End
from .settings import ProbeSettings


def window(probe: ProbeSettings) -> float:
    """Return the width of the averaging window; T = 16 pi / omega_c on page 5: 8 periods."""
    return 2.0 * math.pi * probe.window / probe.omega_c


def pulse_duration(probe: ProbeSettings) -> float:
    """Return 2 t_0 = 12 sigma, the time the boundary is driven."""
    return 12.0 * probe.sigma


def blanking(probe: ProbeSettings) -> float:
    """Return the time from which to look for echoes: the window is clear of the pulse."""
    return pulse_duration(probe) + 0.5 * window(probe)


def listening_time(design: Design, probe: ProbeSettings, end: End) -> float:
    """Return the longest time of an echo: there and back over the whole element, plus its tail."""
    speed = max(SLOWEST, float(group_velocity(probe.omega_c, end.k_s(design))))
    return pulse_duration(probe) + 2.0 * design.N / speed + TAIL


TAIL = 150.0
"""Time units that a read listens after the first crossing, for the echo's peak."""

SLOWEST = 0.15
"""Least group velocity, in cells per time unit, that the listening time allows for."""

FAINTEST = 1e-13
"""Least threshold in cells: the rounding noise of an end that rests near 0."""


def falling(probe: ProbeSettings, t: Array) -> Array:
    """Return v_th exp(-gain_decay t) at times t since the pulse began, without a lower bound."""
    return probe.v_th * exponential(-probe.gain_decay * t)


def threshold(
    probe: ProbeSettings, t: Array, floor: float = 0.0, least: float = FAINTEST
) -> Array:
    """Return the threshold of v_c at times t since the pulse began.

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
    plain = np.maximum(falling(probe, t), least)
    return np.sqrt(plain * plain + floor * floor) if floor else plain


@dataclass(frozen=True)
class Echo:
    """The response to a probe.

    Attributes:
        end: The end that was probed.
        probe: The pulse and the detector's settings.
        t: Times since the pulse began, shape (n,).
        v_m: Displacement magnitude |v - rest|, shape (n,); while the base shakes, of the carrier
            alone.
        v_c: v_m averaged over a centred window of width T, shape (n,).
        delay: Time of the first crossing of the threshold, or None without an echo.
        threshold_margin: Greatest v_c over the threshold: above 1 for an echo.
        floor: Contribution of noise and vibration alone to v_c, measured before the pulse.
        shaken: Whether the base shook.
        spoiled: Whether it began to shake after the pulse, so that the carrier was not filtered.
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

    @property
    def early(self) -> bool:
        """Whether the threshold was already crossed when listening began."""
        if self.delay is None or not len(self.t):
            return False
        return self.delay <= blanking(self.probe) + float(self.t[0])

    @property
    def raised(self) -> float:
        """Factor by which noise raised the threshold at the delay, or at the last sample; >= 1."""
        if self.floor == 0.0:
            return 1.0
        t = np.array(self.delay if self.delay is not None else self.t[-1])
        return float(threshold(self.probe, t, self.floor) / threshold(self.probe, t))


class EchoDetector:
    """Detects an echo sample by sample.

    Attributes:
        probe: The pulse and the detector's settings.
        delay: Time of the first crossing so far, or None.
        threshold_margin: Greatest v_c over the threshold so far.
        time: Time up to which v_c is known.
    """

    def __init__(
        self,
        probe: ProbeSettings,
        dt: float,
        floor: float = 0.0,
        least: float = FAINTEST,
        shaken: bool = False,
    ) -> None:
        """Prepare for the samples of a pulse that begins now.

        Args:
            probe: The pulse and the detector's settings.
            dt: Sampling interval; the first sample is at dt.
            floor: Contribution of noise alone to v_c, which raises the threshold.
            least: Lower bound of the threshold: the contribution of rounding.
            shaken: Whether to filter the carrier, because the base shakes.
        """
        self._floor = floor
        self._least = least
        self.probe = probe
        self.delay: float | None = None
        self.threshold_margin = 0.0
        self._dt = dt
        self._half = max(1, round(0.5 * window(probe) / dt))
        self._lag = half_period(probe, dt) if shaken else 0
        self._past = np.zeros(0)
        self._v_m = np.zeros(0)
        self._sums = np.zeros(1)
        self._v_c = np.zeros(0)

    @property
    def time(self) -> float:
        """Time up to which v_c is known."""
        return len(self._v_c) * self._dt

    def loudest(self, duration: float, ago: float = 0.0) -> float:
        """Return the greatest v_c in an interval that ended some time ago; 0 if nothing was
        received.
        """
        n, last = round(duration / self._dt), len(self._v_c) - round(ago / self._dt)
        return float(self._v_c[max(0, last - n) : max(0, last)].max(initial=0.0))

    def feed(self, v: Array, ticks: int = 1) -> None:
        """Take displacements from rest, shape (ticks m,), and look for a threshold crossing.

        Sums are rounded after each tick.
        """
        if not self._lag:
            self._feed(np.abs(v), ticks)
            return
        for each in np.split(v, ticks):
            before = self._past if len(self._past) else np.repeat(each[:1], 2 * self._lag)
            each = np.concatenate((before, each))
            self._past = each[-4 * self._lag :]
            self._feed(np.abs(carried(each, self._lag)), 1)

    def _feed(self, v_m: Array, ticks: int) -> None:
        within = v_m.reshape(ticks, -1).cumsum(axis=1)
        starts = np.cumsum([self._sums[-1], *within[:-1, -1:].ravel()])
        self._v_m = np.concatenate((self._v_m, v_m))
        self._sums = np.concatenate((self._sums, (starts[:, None] + within).ravel()))
        first, last = len(self._v_c), len(self._v_m) - self._half
        if last <= first:
            return
        i = np.arange(first, last)
        low = np.maximum(i - self._half, 0)
        sums = self._sums[i + self._half + 1] - self._sums[low]
        average = sums / (2 * self._half + 1)
        self._v_c = np.concatenate((self._v_c, average))
        self._compare(np.arange(first + 1.0, last + 1.0) * self._dt, average)

    def _compare(self, t: Array, v_c: Array) -> None:
        heard = t > blanking(self.probe)
        if not heard.any():
            return
        ratio = (v_c / threshold(self.probe, t, self._floor, self._least))[heard]
        self.threshold_margin = max(self.threshold_margin, float(ratio.max()))
        if self.delay is None and (ratio > 1.0).any():
            self.delay = float(t[heard][np.argmax(ratio > 1.0)])

    def echo(self, end: End, spoiled: bool = False) -> Echo:
        """Return everything received at an end, up to the time where v_c is known."""
        n = len(self._v_c)
        t = np.arange(1.0, n + 1.0) * self._dt
        return Echo(
            end,
            self.probe,
            t,
            self._v_m[:n],
            self._v_c,
            self.delay,
            self.threshold_margin,
            self._floor,
            self._lag > 0 or spoiled,
            spoiled,
        )
