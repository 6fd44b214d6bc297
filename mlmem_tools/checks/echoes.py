# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Echoes of all levels at both ends, forecast from small waves on the resting element, without
simulation.

The equation of motion (1a), linearised about the resting configuration, is a three-term recursion
in j for every frequency. Its solution from the far end includes all effects of wall, defects,
gradient and damping on a wave, with no approximation but linearity.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress

import numpy as np

from mlmem.errors import SettingsError
from mlmem.factory import compute_calibration
from mlmem.instrument.drivers import steps_per_tick
from mlmem.instrument.echo import Echo, EchoDetector, earliest_delay, listening_time
from mlmem.instrument.end import End, Pulse
from mlmem.physics import Design, Specimen, StateError, as_specimen
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.physics.pefrl import squared_frequency
from mlmem.physics.values import Array, Complex
from mlmem.readers.calibration import Calibration, DelayTable
from mlmem.readers.decoding import find_exchanged_levels
from mlmem.settings import ProbeSettings, ReadSettings

from .concern import Finding, Subject, Verdict, find_worst_verdict, grade_finding, judge_value


def forecast_echo(
    made: Design | Specimen,
    v: Array,
    probe: ProbeSettings,
    end: End,
    dt: float,
) -> Echo:
    """Return what a device hears of a resting, unstrained element.

    Only the first echo: not the ring-down of the released end, nor multiple reflections.

    Args:
        v: Its displacements at rest, shape (N,).
        probe: Pulse and detector.
        dt: Step of the device, which slows the wave a little (see `squared_frequency`).
    """
    made = as_specimen(made)
    sampling = max(dt, 0.25)  # time units between samples, if the device's own steps are shorter
    samples = math.ceil(listening_time(made.design, probe, end) / sampling)
    period = 2 * samples  # so that later arrivals are not aliased
    t = np.arange(1.0, period + 1.0) * sampling
    pulse = Pulse(0.0, probe)
    driven = np.where(t <= pulse.duration, pulse.evaluate_motion(t)[0], 0.0)
    omega = 2.0 * math.pi / (period * sampling) * np.arange(samples + 1)
    # the pulse has no other frequencies
    used = (np.abs(omega - probe.omega_c) < 5.0 / probe.sigma) & (omega > 0.0)
    spectrum = np.where(used, np.fft.rfft(driven), 0.0)
    spectrum[used] *= echo_response(made, v, omega[used], end, dt)
    detector = EchoDetector(probe, sampling)
    detector.feed_displacements(np.fft.irfft(spectrum, period)[:samples])
    return detector.build_echo(end)


def echo_response(
    specimen: Specimen,
    v: Array,
    omega: Array,
    end: End,
    dt: float = 0.0,
) -> Complex:
    """Return the first echo at a free end relative to the end's driven motion.

    Args:
        specimen: The element, unstrained.
        v: Its displacements at rest, shape (N,).
        omega: Angular frequencies, shape (m,), positive; the time factor is exp(i omega t).
        end: The end that is driven, released and listened to.
        dt: Step of the chain whose dispersion to include; 0 for none.

    Returns:
        Ratio of the complex amplitudes, shape (m,).
    """
    on_site = specimen.alpha * specimen.potential.stiffness(v - specimen.offsets)
    k_r = specimen.k_r
    if end is End.RIGHT:
        on_site, k_r = on_site[::-1], k_r[::-1]
    common = -squared_frequency(omega, specimen.eta, dt)
    ratio = k_r[-1] / (on_site[-1] + common + k_r[-1])  # v_N / v_{N-1}: the far end is free
    for local, left, right in zip(on_site[-2:0:-1], k_r[-2::-1], k_r[:0:-1], strict=True):
        ratio = left / (local + common + left + right * (1.0 - ratio))
    outgoing = solve_propagation(on_site[0] / k_r[0] + common / k_r[0] + 2.0)
    reflected = (ratio - outgoing) / (1.0 / outgoing - ratio)
    return np.asarray(reflected * (1.0 + outgoing))  # a free end moves farther than the wave


def solve_propagation(trace: Complex) -> Complex:
    """Return the decaying theta of Eq. (4), theta + 1 / theta = trace, |theta| < 1."""
    root = np.sqrt(trace**2 - 4.0)
    first = 0.5 * (trace - root)
    return np.where(np.abs(first) < 1.0, first, 0.5 * (trace + root))


def check(subject: Subject, max_calibration_cell_steps: float = 1.5e8) -> Iterator[Finding]:
    """Yield the findings on the echoes by which one wall is read, and that of a blank element.

    Args:
        subject: The design and its settings.
        max_calibration_cell_steps: Most cell steps of a calibration, by default a second's work.
            Above, levels are sampled.
    """
    settings = subject.settings
    dt = settings.time.tick / steps_per_tick(subject.made, settings.time)
    walls = {}
    for level in subject.levels:
        with suppress(StateError):  # `pin_depth` and `echo_...` report it
            walls[level] = find_pinned_wall(subject.made, level)
    loudest, latest, apart = 0.0, 0.0, {}
    for end in End:
        probe = end.select_probe(settings)
        echoes = {n: forecast_echo(subject.made, v, probe, end, dt) for n, v in walls.items()}
        margins = {level: echo.threshold_margin for level, echo in echoes.items()}
        delays = [math.nan if echo.delay is None else echo.delay for echo in echoes.values()]
        loudest = max(loudest, max(margins.values(), default=0.0))
        yield _judge_echoes(end, margins, delays, end is settings.read.primary_end)
        latest = max(latest, *delays, 0.0)
        apart[end] = _find_least_spacing(probe, echoes)
    work = len(End) * subject.design.levels * subject.design.N * latest / dt
    calibration = None
    if work <= max_calibration_cell_steps:
        with suppress(SettingsError, StateError):  # `echo_...` reports why it has none
            calibration = compute_calibration(subject.made, subject.design, settings)
    yield _judge_separation(subject, calibration, apart)
    yield _judge_reverberation(subject.made.eta, settings.read, loudest)
    blank, probe = make_blank(subject.made), End.RIGHT.select_probe(settings)
    empty = forecast_echo(subject.made, blank, probe, End.RIGHT, dt)
    yield grade_finding(
        'echo_blank',
        {'over threshold': empty.threshold_margin},
        '',
        judge_value(empty.threshold_margin, 1.0, 1.25),
        'a blank element is recognised by the echo of its far end',
        'the far end of a blank element is hardly heard from the right, so an erase cannot be '
        'verified: choose a smaller v_th or another carrier for probe_right',
    )


def _find_least_spacing(probe: ProbeSettings, echoes: Mapping[int, Echo]) -> tuple[float, int]:
    """Return the least time between the echoes of two neighbours, and the lower one; infinity if
    none are heard.
    """
    least = math.inf, 0
    for level, echo in echoes.items():
        above = echoes.get(level + 1)
        if above and echo.delay is not None and above.delay is not None:
            pair = DelayTable((echo.delay, above.delay), shapes=(echo.shape, above.shape))
            least = min(least, (_find_closest_levels(pair, probe)[0], level))
    return least


def _find_closest_levels(table: DelayTable, probe: ProbeSettings) -> tuple[float, int]:
    """Return the least time between the crossings of a level and of the next one, on average over
    the crossings that all levels have, and which level; infinity if there is only one.
    """
    known = table.crossings[:, np.isfinite(table.crossings).all(axis=0)]
    between = np.abs(np.diff(np.maximum(known, earliest_delay(probe)), axis=0)).mean(axis=1)
    level = int(between.argmin()) if len(between) else 0
    return float(between.min(initial=np.inf)), level


def _judge_separation(
    subject: Subject, calibration: Calibration | None, apart: Mapping[End, tuple[float, int]]
) -> Finding:
    """Judge whether either end by itself tells a level from all others: proven by the tables of a
    calibration, or else from `apart`, which is of sampled neighbours.
    """
    settings, wrong = subject.settings, []
    if calibration is not None:
        wrong = find_exchanged_levels(subject.design, settings, calibration)
        apart = {
            end: _find_closest_levels(calibration.table(end), end.select_probe(settings))
            for end in End
        }
    values = {f'at the {end}': time for end, (time, _) in apart.items()}
    end = min(apart, key=lambda end: apart[end])
    level = apart[end][1]
    if wrong:
        errs, _, level = wrong[0]
        end = errs.opposite
    proven = Verdict.FAIL if wrong else Verdict.PASS
    verdict = find_worst_verdict(
        # sound elements are off by 0.6
        (proven, *(judge_value(time, 1e-9, 1.0) for time in values.values()))
    )
    of = 'as far as levels were sampled, ' if calibration is None else ''
    return grade_finding(
        'apart',
        values,
        'time',
        verdict,
        f'{of}either end tells a level from all others by itself, so no error of one end alone '
        'turns one into another',
        f'the {end} end hardly tells level {level} from another, so reads refuse both: leave more '
        'cells before the first level there, or choose a shorter pulse',
    )


def _judge_reverberation(eta: float, read: ReadSettings, loudest: float) -> Finding:
    """Judge how long a pulse bounces until the next one may be fired."""
    fades = math.log(max(1.0, loudest / read.wave_limit))
    needed = fades / (0.5 * eta) if eta > 0.0 else math.inf
    return grade_finding(
        'reverberation',
        {'needed': needed, 'given': read.settle_timeout},
        'time',
        # strains are louder than pulses
        judge_value(read.settle_timeout / needed if needed else math.inf, 1.0, 1.5),
        'a pulse that bounces between wall and end fades within read.settle_timeout',
        'a pulse still bounces between wall and end after that time, and the next one would '
        'hear it: choose more damping, a greater v_th or a longer read.settle_timeout',
    )


def _judge_echoes(
    end: End,
    margins: dict[int, float],
    delays: list[float],
    names_level: bool,
) -> Finding:
    """Judge the echoes at an end; the one that names the level must tell all apart."""
    group = 'probe' if end is End.LEFT else 'probe_right'
    if not margins:
        text = 'no level holds a wall at rest'
        return Finding(f'echo_{end}', {}, '', Verdict.FAIL, text)
    faintest = min(margins, key=lambda level: margins[level])
    steps = np.diff(delays) * (1.0 if end is End.LEFT else -1.0)
    order = (
        # the end that only confirms needs 90 % of the levels in order
        bool(np.mean(steps > 0.0) >= (1.0 if names_level else 0.9)) if len(steps) else True
    )
    # a quarter more covers what the forecast neglects (some 10 %)
    heard = judge_value(margins[faintest], 1.0, 1.25)
    verdict = find_worst_verdict((heard, Verdict.PASS if order else Verdict.FAIL))
    if heard is not Verdict.PASS:
        text = (
            f'level {faintest} has the weakest echo, hardly heard: choose a smaller {group}.v_th, '
            'a faster carrier, less damping or fewer cells'
        )
    elif not order:
        listed = ', '.join(f'{delay:.0f}' for delay in delays)
        text = (
            f'the delays do not distinguish the levels: {listed}; the echo of a wall that is too '
            'near arrives while the pulse is still ringing: leave more cells before it, or '
            'choose a shorter pulse'
        )
    else:
        text = f'every level is heard; the weakest is {faintest}'
    values = {
        'first over threshold': next(iter(margins.values())),
        'faintest': margins[faintest],
        'least delay': float(np.min(delays)),  # NaN if a level is not heard
        'greatest delay': float(np.max(delays)),
    }
    return Finding(f'echo_{end}', values, '', verdict, text)
