# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What both ends do after the pulse of a read: how it is compared, and how it is forecast, for
walls and kinks anywhere.

A pulse is small, so the forecast is that of small waves (`physics.waves`): the left end follows
the pulse, which takes the force f = (p / q) u_1, and is free afterwards, which ends that force.
What the ends of a simulated element do differs by 0.3 % of the pulse, most of it because a wall is
not quite linear: a tenth of the pulse leaves 0.04 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..instrument.blocks import run
from ..instrument.drivers import Simulation, steps_per_tick
from ..instrument.echo import pulse_duration
from ..instrument.end import End, Pulse, Shot
from ..instrument.instrument import Instrument
from ..physics import Specimen
from ..physics.values import Array
from ..physics.waves import Complex, Tones, combine_rows, linearize_cells, multiply_matrices
from ..settings import ProbeSettings, Settings
from .listening import fire_pulse

Delays = tuple[float, float]
"""By how much the signals of the driven end and of the other are late."""

NO_DELAYS: Delays = (0.0, 0.0)


@lru_cache(maxsize=64)  # shared by equal pulses; each takes two, for the read and its noise
def build_band_basis(probe: ProbeSettings, n: int, dt: float) -> Array:
    """Return the windowed cosines and sines of a pulse's band for n samples, shape (n, 2 m)."""
    span = n * dt
    low, high = (
        round((probe.omega_c + side * _half_band(probe)) * span / (2.0 * math.pi))
        for side in (-1.0, 1.0)
    )
    t = dt * np.arange(1.0, n + 1.0)
    # fade in and out over 4 sigma
    edge = np.minimum(t, span + dt - t) / min(4.0 * probe.sigma, 0.5 * span)
    window = 0.5 * (1.0 - np.cos(math.pi * np.minimum(1.0, edge))) * math.sqrt(2.0 * dt / n)
    phase = 2.0 * math.pi / span * np.outer(t, np.arange(max(1, low), high + 1))
    basis = np.concatenate((np.cos(phase), np.sin(phase)), axis=1) * window[:, None]
    basis.setflags(write=False)
    return basis


def _half_band(probe: ProbeSettings) -> float:
    """Return half the width of a pulse's band, which holds all of its spectrum; slow waves that
    are left of a kick lie outside.
    """
    return 4.0 / probe.sigma


class Listener:
    """What is received after the pulse of a read: the part of both ends' motion in its band.

    Attributes:
        ticks: Ticks for which both ends are recorded.
        compared_ends: How many ends are compared, the driven one first.
    """

    def __init__(self, settings: Settings, compared_ends: int = 2) -> None:
        """Prepare for the pulse of the settings, compared at so many ends."""
        self.compared_ends = compared_ends
        self._probe = settings.register.probe
        time = pulse_duration(self._probe) + settings.register.listen
        self._tick = settings.time.tick
        self.ticks = math.ceil(time / self._tick)

    def project_shot(self, shot: Shot, delays: Delays = NO_DELAYS) -> Array:
        """Return the part of a shot in the band, the driven end first, as if its signals had
        come so much later: shape (4 m,), or (2 m,) if one end is compared.
        """
        motion = shot.samples - shot.rest[:, None]
        driven_first = motion[::-1] if shot.end is End.RIGHT else motion
        if any(delays):
            t = shot.dt * np.arange(motion.shape[1])
            late = zip(driven_first, delays, strict=True)
            driven_first = np.array([np.interp(t - delay, t, each) for each, delay in late])
        compared = driven_first[: self.compared_ends]
        basis = build_band_basis(self._probe, motion.shape[1], shot.dt)
        return (compared @ basis).ravel()

    def noise(self, before: Array, dt: float) -> float:
        """Return what noise contributes to the square of a projected shot, from displacements of
        both ends before the pulse, shape (2, w).
        """
        motion = before - before.mean(axis=1, keepdims=True)
        basis = build_band_basis(self._probe, before.shape[1], dt)
        time = self.ticks * self._tick
        lines = round(2.0 * _half_band(self._probe) * time / (2.0 * math.pi))
        share: float = (2.0 * lines + 2.0) / basis.shape[1]
        power: float = np.square(motion @ basis).sum()
        return power * share


class PulseSpectrum(NamedTuple):
    """What all forecasts of a pulse have in common.

    Attributes:
        omega: Frequencies of a forecast, shape (F,).
        pulse: The spectrum of the driven end's motion, shape (F,).
        ended: Makes of a spectrum that of what ends with the pulse; rows and columns: real parts,
            then imaginary ones; shape (2 F, 2 F).
        projection: Makes of a spectrum the part in the band, shape (2 F, 2 m).
    """

    omega: Complex
    pulse: Complex
    ended: Array
    projection: Array


@lru_cache(maxsize=8)  # shared by elements with the same pulse
def build_spectrum(probe: ProbeSettings, n: int, dt: float) -> PulseSpectrum:
    """Return the spectrum of a pulse, of which n samples are received."""
    # What would come after the period of the forecast is added to what comes before, by less
    # than a thousandth.
    period, decay_exponent = 1.4 * n * dt, 6.0
    # 5 / sigma: a faded recording has a wider band than the one that is compared
    low, high = (
        (probe.omega_c + side * 5.0 / probe.sigma) * period / (2.0 * math.pi)
        for side in (-1.0, 1.0)
    )
    lines = np.arange(max(1, math.floor(low)), math.ceil(high) + 1)
    omega = np.asarray(
        2.0 * math.pi / period * lines - 1j * decay_exponent / period, dtype=np.complex128
    )
    motion = Pulse(0.0, probe)
    t = dt / 8.0 * np.arange(1.0, 8.0 * motion.duration / dt)  # zero at its begin and end
    pulse = np.exp(-1j * np.outer(omega, t)) @ motion.evaluate_motion(t)[0] * (t[1] - t[0])
    # The spectrum of what ends with the pulse, from those of it and its complex conjugate.
    same, other = (
        _integrate_exponential(each[:, None] - omega, motion.duration) / period
        for each in (omega, -omega.conj())
    )
    of_real, of_imag = same + other, 1j * (same - other)
    ended = np.block([[of_real.real, of_real.imag], [of_imag.real, of_imag.imag]])
    t = dt * np.arange(1.0, n + 1.0)
    wave = 2.0 / period * np.exp(1j * np.outer(omega, t))
    projection = np.concatenate((wave.real, -wave.imag)) @ build_band_basis(probe, n, dt)
    for each in (omega, pulse, ended, projection):
        each.setflags(write=False)
    return PulseSpectrum(omega, pulse, ended, projection)


class Ends:
    """Forecasts what a listener receives of small waves in an element.

    Attributes:
        tones: The frequencies of the forecast.
    """

    def __init__(self, made: Specimen, settings: Settings, listener: Listener) -> None:
        """Prepare for an element, the pulse of the settings, and a listener."""
        steps = steps_per_tick(made, settings.time)
        dt = settings.time.tick / steps
        self._spectrum = build_spectrum(settings.register.probe, listener.ticks * steps, dt)
        self.tones = Tones.from_steps(made, self._spectrum.omega, dt)
        self._compared_ends = listener.compared_ends

    def compute_parts(self, lower: Complex, delays: Delays = NO_DELAYS) -> Array:
        """Return the parts, shape (m, 4 lines), of elements with lower rows (p, q), shape
        (m, 2, F), as late signals show them.
        """
        spectrum, p, q = self._spectrum, lower[:, 0], lower[:, 1]
        held = p / q * spectrum.pulse  # force on the driven end while the pulse lasts; none later
        ended = np.concatenate((held.real, held.imag), axis=1) @ spectrum.ended
        force = ended[:, : len(held.T)] + 1j * ended[:, len(held.T) :]
        late = np.exp(-1j * np.outer(delays, self.tones.omega))
        ends = np.stack((force * q / p, force / p), axis=1) * late
        ends = ends.reshape(2 * len(lower), -1)
        projected = np.concatenate((ends.real, ends.imag), axis=1) @ spectrum.projection
        by_end = projected.reshape(len(lower), 2, -1)[:, : self._compared_ends]
        return np.asarray(by_end.reshape(len(lower), -1))

    def compute_answers(
        self,
        made: Specimen,
        walls_at: Sequence[Array],
        end: End = End.LEFT,
        delays: Sequence[Delays] = (NO_DELAYS,),
    ) -> Array:
        """Return the parts of an element that rests in some displacements, shape (N,) each, after
        a pulse of an end: that end comes first. Its damping and step are those of these forecasts.

        The shape is (delays times displacements, 4 lines), and all of the first delays come first.
        """
        square, loss = self.tones.square, self.tones.loss
        found = [linearize_cells(made, v) for v in walls_at]
        if end is End.RIGHT:
            found = [
                (stiffness[::-1].copy(), mass[::-1].copy(), np.append(spring[-2::-1], 1.0))
                for stiffness, mass, spring in found
            ]
        matrices = np.array([multiply_matrices(*each, square, loss) for each in found])
        lower = combine_rows(matrices, np.arange(len(matrices))[:, None])
        return np.concatenate([self.compute_parts(lower, each) for each in delays])


def simulate_answers(
    made: Specimen,
    walls_at: Sequence[Array],
    settings: Settings,
    listener: Listener,
    end: End = End.LEFT,
    delays: Sequence[Delays] = (NO_DELAYS,),
) -> Array:
    """Return the parts that `Ends.compute_answers` returns, of an element with dry friction.

    Friction weakens a small wave more than a large one, so each answer is simulated with the
    pulse as strong as it is.
    """
    driver = Simulation.build_blank(made, settings.time)
    twin, shots = Instrument(made.design, settings, driver), []
    for v in walls_at:
        driver.chain.place(v)
        twin.transducer.assume_equilibrium()
        shots.append(run(twin, fire_pulse(twin, end, settings.register.probe, listener.ticks)))
    return np.array([listener.project_shot(shot, late) for late in delays for shot in shots])


def _integrate_exponential(omega: Complex, end: float) -> Complex:
    """Return the integral of exp(i omega t) from 0 to an end."""
    at_0 = omega == 0.0
    some = np.where(at_0, 1.0, omega)
    return np.asarray(np.where(at_0, end, (np.exp(1j * some * end) - 1.0) / (1j * some)))
