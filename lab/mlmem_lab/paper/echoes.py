# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One probe of a resting element: the pulse goes in at an end, and the end is listened to."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from mlmem.instrument.echo import Echo, EchoDetector
from mlmem.instrument.end import BoundaryMotion, End, Pulse
from mlmem.physics import Chain, Design, HeldCell, substep_times
from mlmem.physics.values import Array
from mlmem.settings import ProbeSettings

PAPER_PROBE = ProbeSettings(omega_c=2.0, v_th=7.5e-5, gain_decay=0.0)
"""The paper's detector, a plain threshold, with our reading of its two numbers."""

PRINTED_PROBE = ProbeSettings(omega_c=2.4, v_th=7.5e-3, gain_decay=0.0)
"""The paper's detector with the numbers as printed."""


def record_echo(
    design: Design,
    v: Array,
    probe: ProbeSettings,
    end: End = End.LEFT,
    duration: float = 1200.0,
    dt: float | None = 1.0 / 32.0,
    settle: float = 0.0,
) -> tuple[Array, float]:
    """Fire one pulse into a resting, unstrained element and listen at the same end.

    Args:
        v: Its displacements at rest, shape (N,).
        duration: Time from the beginning of the pulse, in time units.
        dt: Step; None: the chain's own. By default delays have converged: half of it changes none
            by more than a sample.
        settle: Time to come to rest before: an elastic substrate gives way under a wall.

    Returns:
        Displacement of the end from its rest after every step, and the step.
    """
    chain = Chain(design, dt)
    chain.place(v)
    chain.advance_steps(math.ceil(settle / chain.dt))
    rest = chain.end(end.site(design))
    return drive_end(chain, Pulse(rest, probe), duration, end) - rest, chain.dt


def drive_end(chain: Chain, motion: BoundaryMotion, duration: float, end: End = End.LEFT) -> Array:
    """Make an end follow a motion at constant strain, then release it; return its displacement
    after every step of the duration, which begins with the motion.
    """
    times = substep_times(math.ceil(duration / chain.dt), chain.dt)
    motion_values = motion.evaluate_motion(times[times <= motion.duration])
    held_cell = HeldCell(end.site(chain.design), motion_values)
    return np.asarray(chain.advance(np.full(len(times), chain.V_N), held_cell)[end.row])


def detect_echo(displacement: Array, dt: float, probe: ProbeSettings, end: End = End.LEFT) -> Echo:
    """Return what the device's detector makes of displacements from rest, shape (n,)."""
    detector = EchoDetector(probe, dt, filtered=False)
    detector.feed_displacements(displacement)
    return detector.build_echo(end)


def probe_element(
    design: Design, v: Array, probe: ProbeSettings, end: End = End.LEFT, duration: float = 1200.0
) -> Echo:
    """Return what the device's detector makes of what `record_echo` hears."""
    return detect_echo(*record_echo(design, v, probe, end, duration), probe, end)


def without_wall(
    design: Design, probe: ProbeSettings, end: End = End.LEFT, duration: float = 1200.0
) -> tuple[Array, float]:
    """Listen as `record_echo` does to an element of one phase, too long to echo from its far
    end.
    """
    longer = math.ceil(0.36 * duration)  # half of what the fastest wave, 0.72 cells/time, covers
    if end is End.LEFT:
        endless = dataclasses.replace(design, N=design.N + longer)
        return record_echo(endless, np.full(endless.N, design.D_s2), probe, end, duration)
    # From the right the chain goes on beyond j = 1 with cells like the first one: shift the
    # pattern so that the probed end keeps its place among the defects.
    # 1 + gamma (j - shift) is (1 - gamma shift) (1 + gamma' j).
    shift = math.ceil(longer / design.J_s) * design.J_s
    scale = 1.0 - design.gamma * shift
    endless = dataclasses.replace(
        design, N=design.N + shift, gamma=design.gamma / scale, d=design.d * scale
    )
    return record_echo(endless, np.full(endless.N, design.D_s1), probe, end, duration)
