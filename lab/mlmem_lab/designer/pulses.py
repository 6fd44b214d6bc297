# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Choosing the pulses of both ends: carrier, length, threshold, and the room they need.

The right end names the level, and the left one confirms it. The right end hears the whole element:
in the inactive phase waves are three times faster than in the active one, and the other phase
reflects them. What limits either end is clutter: the defects are a grating of period J, which
reflects waves wherever kappa = n pi / J (a Bragg gap). A long pulse is narrow enough to fit
between two gaps.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mlmem.instrument.end import End
from mlmem.physics import PEFRL, Design, Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.waves import fastest_speed, group_velocity, pass_band
from mlmem.readers.echo import blanking_time, detection_threshold
from mlmem.settings import ProbeSettings
from mlmem_tools.checks.echoes import forecast_echo

ENVELOPE_LENGTHS = (12.0, 16.0, 20.0, 24.0, 30.0, 40.0, 50.0)
"""Standard deviations of the envelope to try, shortest first."""

MIN_CLUTTER_RATIO = 30.0
"""Least ratio of the faintest echo to the clutter before it, both compensated for damping."""

MAX_THRESHOLD_RATIO = 7.7
"""Greatest ratio of the faintest echo to the threshold: it is then crossed 2.0 sigma before the
peak of the echo."""

MAX_LOSS_DB = 60.0
"""Most loss of the farthest echo by damping, in dB."""

MAX_CARRIER_RATIO = 0.91
"""Carrier over the lower band edge of the active phase, roughly, for the damping alone."""

HALF_WIDTH = 0.9
"""Distance of the carrier from the upper edge of the usable band, in 1 / sigma."""

CONFIRM_SIGMA = 6.0
"""Standard deviation of the left end's envelope: of all levels only the first is so near that its
echo begins before the pulse has ended."""

BAND_EDGE_DISTANCE = 0.015
"""Distance of its carrier from the upper edge of the inactive phase's band, above which the wall
reflects everything: there the echo's front is steepest."""

LEAST_CLUTTER = 7.3e-5
"""Clutter of a pulse that has just ended, in cells."""

OVER_CLUTTER = 1.7
"""Its threshold over the clutter: the lower, the steeper is the front that crosses it."""


def confirm_probe(design: Design) -> ProbeSettings:
    """Return the pulse and detector with which the left end confirms a level."""
    edge = pass_band(design.k_s1 * float(design.alpha.max()))[1]
    probe = ProbeSettings(
        omega_c=round(edge - BAND_EDGE_DISTANCE, 3),
        sigma=CONFIRM_SIGMA,
        gain_decay=0.5 * design.eta,
        v_th=0.5,
    )
    far = design.levels - 1
    v = find_pinned_wall(Specimen(design), far)
    echo = forecast_echo(design, v, probe, End.LEFT, PEFRL.accurate_step, PEFRL)
    fastest = 2.0 * End.LEFT.distance(design, far) / fastest_speed(design.k_s2)
    before = (echo.t > blanking_time(probe)) & (echo.t < fastest)
    gain = probe.v_th / detection_threshold(probe, echo.t[before])
    clutter = float((gain * echo.v_c[before]).max(initial=LEAST_CLUTTER))
    return replace(probe, v_th=float(f'{OVER_CLUTTER * clutter:.1e}'))


def choose_probe(design: Design) -> tuple[ProbeSettings, int] | None:
    """Return the shortest pulse that hears every level clearly, and the tail that it needs.

    The tail of the design may still be too short.

    Returns:
        Pulse and detector of the right end, and the cells that this end needs beyond the last
        level's spacing; None if no pulse is clear of the clutter.
    """
    lowest = pass_band(design.k_s1 * float(design.alpha.max()))[0]
    highest = pass_band(design.k_s2 * float(design.alpha.min()))[0]
    for sigma in ENVELOPE_LENGTHS:
        probe = ProbeSettings(
            omega_c=round(highest - HALF_WIDTH / sigma, 3), sigma=sigma, window=4.0,
            gain_decay=0.5 * design.eta, v_th=0.5,
        )  # fmt: skip
        if probe.omega_c > lowest and (found := _fit_threshold(design, probe)):
            return found
    return None


def _fit_threshold(design: Design, probe: ProbeSettings) -> tuple[ProbeSettings, int] | None:
    """Return the pulse with the threshold and the tail for the two farthest echoes."""
    speed = float(group_velocity(probe.omega_c, design.k_s1))
    # Forecast with the room that the pulse will have, so that it hides nothing.
    roomy = replace(design, N=design.N - design.tail + 400, tail=400)
    far = [np.full(roomy.N, roomy.D_s1), find_pinned_wall(Specimen(roomy), 0)]
    signal, clutter = math.inf, 0.0
    for v in far:
        echo = forecast_echo(roomy, v, probe, End.RIGHT, PEFRL.accurate_step, PEFRL)
        heard = echo.t > blanking_time(probe)
        t, v_c = echo.t[heard], echo.v_c[heard]
        gain = probe.v_th / detection_threshold(probe, t)
        arrives = 6.0 * probe.sigma + 2.0 * (roomy.N - roomy.defect_site(0)) / speed
        before = t < arrives - 10.0 * probe.sigma
        signal = min(signal, float((gain * v_c)[~before].max()))
        clutter = max(clutter, float((gain * v_c)[before].max(initial=0.0)))
    if signal < MIN_CLUTTER_RATIO * clutter:
        return None
    v_th = float(f'{max(math.sqrt(signal * clutter), signal / MAX_THRESHOLD_RATIO):.1e}')
    early = probe.sigma * math.sqrt(2.0 * math.log(signal / v_th))
    room = 0.5 * speed * (blanking_time(probe) - 6.0 * probe.sigma + early)
    return replace(probe, v_th=v_th), math.ceil(room / design.J) * design.J


def greatest_damping(design: Design) -> float:
    """Return the greatest damping 1 / (250 n) that leaves the farthest echo audible."""
    speed = float(group_velocity(MAX_CARRIER_RATIO * pass_band(design.k_s2)[0], design.k_s1))
    time = 2.0 * (design.N + design.J) / speed
    greatest = 2.0 * math.log(10.0 ** (MAX_LOSS_DB / 20.0)) / time
    return 1.0 / (250.0 * max(1, math.ceil(1.0 / (250.0 * greatest))))
