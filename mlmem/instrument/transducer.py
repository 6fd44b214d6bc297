# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The transducers at both ends: hold or free a boundary cell, sense its displacement, and know
what may still be on its way to it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..errors import ErrorCode, SettingsError
from ..physics import Design, HeldCell, substep_times
from ..physics.formulas import exponential
from ..physics.values import Array
from ..physics.waves import pass_band
from ..schema import describe_field
from ..settings import ProbeSettings, Settings
from .drivers import Driver
from .echo import MIN_THRESHOLD_CELLS, EchoDetector, carrier_amplitudes, compute_weights
from .end import BoundaryMotion, End, Pulse, WaveformRecorder
from .faults import NO_FAULTS, Faults, apply_transducer_faults

UNLIMITED_SAMPLES = 2**53
"""More samples than are ever taken."""


@dataclass(frozen=True)
class Returns:
    """What is known of the waves that an end may still see; by default it was never driven."""

    bound: float = describe_field(
        0.0,
        'greatest mean |v| of the carrier in a tick that may still arrive, in cells',
        low=0.0,
    )
    since: int = describe_field(UNLIMITED_SAMPLES, 'samples since the end was last driven', low=0)
    seen: int = describe_field(0, 'samples in which that motion itself is seen', low=0)


class Reverberation:
    """Follows the waves at one end.

    An end that is still for a moment proves nothing: a packet of waves bounces between the wall
    and the end, and between two arrivals it is not seen. But on its way it only loses energy, so
    what an end has seen bounds what it will see again: its greatest motion, less exp(-eta t / 2).
    That holds for everything that has reached an end at least once since it was excited.

    Attributes:
        returns: What is known of them.
        gain: Mean |v| that the filter leaves of a white noise with mean |v| of 1.
        memory: Samples that the filter looks back.
    """

    def __init__(self, design: Design, probe: ProbeSettings, dt: float) -> None:
        """Follow an end that is at rest, for the echoes of a probe, sampled at intervals dt."""
        self.returns = Returns()
        self._weights = compute_weights(probe, dt)
        self._loss = 0.5 * design.eta * dt
        self._kept: dict[int, float] = {}
        self.gain = math.sqrt(float(np.square(self._weights).sum()))
        self.memory = len(self._weights) - 1

    def ignore_samples(self, samples: int) -> None:
        """Ignore the end while it is driven, for some samples: its waves are yet to return."""
        self.returns = Returns(self.returns.bound, 0, samples + self.memory)

    def mark_returned(self) -> None:
        """Take note that the waves of its last motion have come back, so that they are bounded."""
        self.returns = replace(self.returns, since=UNLIMITED_SAMPLES)

    def count_fading_samples(self, limit: float) -> int:
        """Return after how many samples the bound is at a limit at the earliest; it may be never.

        Without damping, waves are bounded by what they were.
        """
        if self.returns.bound <= limit:
            return 0
        if self._loss == 0.0:
            return UNLIMITED_SAMPLES
        return max(1, math.floor(math.log(self.returns.bound / limit) / self._loss))

    def measure_amplitude(self, v: float, n: int) -> float:
        """Return the mean |v| of the carrier in a tick of n samples which, as all before, are v.

        The filter removes a constant up to rounding.
        """
        return carrier_amplitudes(np.full(self.memory + n, v), self._weights, 1)[0]

    def pass_by(self, loudness: float, n: int, ticks: int) -> None:
        """Take ticks of n samples that are all the same; see `carrier_amplitudes`. Nothing is
        driven.
        """
        bound, since, seen = self.returns.bound, self.returns.since, self.returns.seen
        if bound > loudness:
            fading = np.full(ticks + 1, self._compute_remaining(n))
            fading[0] = bound
            bound = float(np.multiply.accumulate(fading)[-1])  # one by one, as in `follow`
        since = min(since + n * ticks, UNLIMITED_SAMPLES)
        self.returns = Returns(max(bound, loudness), since, seen)

    def follow_samples(self, v: Array, ticks: int) -> None:
        """Take the samples of ticks, shape (memory + n,), after those that the filter needs."""
        n = (len(v) - self.memory) // ticks
        kept = self._compute_remaining(n)
        bound, since, seen = self.returns.bound, self.returns.since, self.returns.seen
        for loud in carrier_amplitudes(v, self._weights, ticks):
            bound *= kept
            if loud > bound and since >= seen:
                bound = loud
            since += n
        self.returns = Returns(bound, min(since, UNLIMITED_SAMPLES), seen)

    def _compute_remaining(self, n: int) -> float:
        """Return what is left of a wave after n samples."""
        if n not in self._kept:
            self._kept[n] = float(exponential(np.array(-self._loss * n)))
        return self._kept[n]


class Held(NamedTuple):
    """A held boundary cell: its prescribed motion, its site, and the steps done."""

    motion: BoundaryMotion
    site: int
    steps: int


@dataclass(frozen=True)
class TransducerState:
    """The state of the transducers while they drive nothing.

    Attributes:
        recent: Last displacements of both ends, shape (2, w), newest last.
        returns: What is known of the waves that may still arrive, by end.
    """

    recent: Array
    returns: Mapping[End, Returns]


class Transducer:
    """Drives and senses the first and the last cell of a chain.

    Attributes:
        ends: The ends that have a transducer. Another one is taken for inactive and at rest.
        recent: Last displacements of both ends, shape (2, w), newest last. They give the rest
            displacement, and show whether the element is quiet.
        reverberation: The waves that may still arrive, by end.
        recorders: What records both ends, by pulse, in their order.
        held: The held boundary cell, or None.
        interrupted: Whether listening was interrupted since the pulse.
        shaken: Whether the base has shaken enough to move the wall since the pulse.
    """

    def __init__(self, design: Design, settings: Settings, driver: Driver) -> None:
        """Fit transducers to the ends of an element.

        Raises:
            SettingsError: A carrier is so slow that too many samples would have to be kept.
        """
        self._design = design
        self._driver = driver
        self.ends = (End.LEFT,) if settings.has_one_transducer else tuple(End)
        self.set_probes(settings)
        slowest = min(probe.omega_c for probe in self.probes.values())
        dt = driver.dt
        # the rest displacement is averaged over eight periods of the slowest carrier
        width = 2.0 * math.pi * 8.0 / slowest
        self._difference = _find_difference_order(design, dt)
        samples = max(math.ceil(width / dt), self._difference + 1)
        if samples > (most := 1_000_000):
            raise SettingsError(
                ErrorCode.CONFLICT, 'omega_c', slowest,
                f'at least {slowest * samples / most:.4g} with steps of {dt:.4g}, or '
                f'the rest displacement needs more than {most} samples',
            )  # fmt: skip
        self.reverberation = {
            end: Reverberation(design, probe, dt) for end, probe in self.probes.items()
        }
        samples = max(samples, *(each.memory for each in self.reverberation.values()))
        self.recent: Array = np.empty((2, samples))
        self._recorded: Array | None = None  # `recent`, if it was heard
        self._flat: Array | None = None  # `recent`, if all its samples are the same
        self.assume_equilibrium()
        self.detectors: dict[End, EchoDetector] = {}
        self.recorders: list[WaveformRecorder] = []
        self.interrupted = self.shaken = False
        self._hums: dict[End, float] = {}  # what the filters leave of them
        self._late: dict[End, int] = {}  # ticks still to come of samples from before the pulse
        self._rest: dict[End, float] = {}
        self._lag = round(driver.lag * settings.time.tick / dt)
        self.held: Held | None = None

    def set_probes(self, settings: Settings) -> None:
        """Fire the pulses of these settings from now on."""
        self.probes = {end: end.select_probe(settings) for end in End}

    @property
    def state(self) -> TransducerState:
        """What is known of both ends; to set it releases a held cell."""
        returns = {end: each.returns for end, each in self.reverberation.items()}
        return TransducerState(self.recent, returns)

    @state.setter
    def state(self, state: TransducerState) -> None:
        self.release_ends()
        self.recent = state.recent
        for end, each in self.reverberation.items():
            each.returns = state.returns[end]

    @property
    def is_driving(self) -> bool:
        """Whether a boundary cell is held."""
        return self.held is not None

    @property
    def remaining_time(self) -> float:
        """Time until the held cell is released; 0 if none is held."""
        if self.held is None:
            return 0.0
        return self.held.motion.duration - self.held.steps * self._driver.dt

    # --- sensing -------------------------------------------------------------------------

    def assume_equilibrium(self) -> None:
        """Assume that both ends have rested where they are."""
        self._recorded = self._flat = None
        for end, reverberation in self.reverberation.items():
            self.recent[end.row] = self.find_displacement(end)
            reverberation.returns = Returns()

    @property
    def at_rest(self) -> bool:
        """Whether nothing is driven or recorded, and all recent samples of an end are the same."""
        if self.is_driving or self.detectors or self.recorders:
            return False
        for each in self.reverberation.values():
            if each.returns.since < each.returns.seen:  # its own drive is still seen
                return False
        recent = self.recent
        if self._flat is not recent:
            assumed = self._recorded is not recent  # nothing was heard since, not even noise
            if assumed or recent[0, -1] != recent[0, -2] or (recent != recent[:, -1:]).any():
                return False
            self._flat, self._hums = recent, {}
        return True

    @property
    def has_last_displacements(self) -> bool:
        """Whether both ends are where they were last recorded."""
        return all(self.find_displacement(end) == self.recent[end.row, -1] for end in End)

    def find_displacement(self, end: End) -> float:
        """Return the displacement of an end now, or that of its phase if nothing senses it."""
        if end not in self.ends:
            return self._design.D_s1
        return self._driver.end(end.site(self._design))

    def measure_rest(self, end: End) -> float:
        """Return the mean displacement of an end over the recent samples."""
        return float(self.recent[end.row].mean())

    def measure_unrest(self, end: End) -> float:
        """Return the mean departure of an end from its rest over the recent samples."""
        samples = self.recent[end.row]
        return float(np.abs(samples - samples.mean()).mean())

    def noise(self, end: End) -> float:
        """Return the sensor's share of `unrest`: mean size of the noise in the recent samples.

        A difference of high enough order contains less than 0.1 % of a motion as fast as the pass
        bands allow, but all of a white noise. For Case II that is order 6 with samples 0.25 time
        units apart, and order 13 with 0.5.
        """
        differences = np.diff(self.recent[end.row], self._difference)
        return float(np.abs(differences).mean()) / _compute_noise_gain(self._difference)

    @property
    def speed(self) -> float:
        """Speed of the first cell."""
        if (chain := self._driver.chain) is not None:
            return float(chain.velocity[0])
        return float(self.recent[0, -1] - self.recent[0, -2]) / self._driver.dt

    # --- driving -------------------------------------------------------------------------

    def fire_probe(self, end: End, floor: float = 0.0) -> EchoDetector:
        """Fire the probe pulse of an end, about its rest, and listen for the echo.

        `floor` is the contribution of noise alone to v_c, in cells.
        """
        detector = self.listen_only(end, floor)
        self._begin_recording(end, self.probes[end])
        self.drive_end(end, Pulse(self._rest[end], self.probes[end]))
        return detector

    def listen_only(self, end: End, floor: float = 0.0) -> EchoDetector:
        """Listen as after a pulse (see `fire`) without firing one."""
        if not self.detectors:
            self.interrupted = self.shaken = False
        rest = self._rest[end] = self.measure_rest(end)
        self._late[end] = self._driver.lag
        least = MIN_THRESHOLD_CELLS * max(1.0, abs(rest))  # relative rounding
        past = self.recent[end.row] - rest
        detector = EchoDetector(self.probes[end], self._driver.dt, floor, least, past)
        self.detectors[end] = detector
        return detector

    def record_pulse(self, end: End, probe: ProbeSettings) -> WaveformRecorder:
        """Fire a pulse of any shape about the rest of an end, and record both ends."""
        self.shaken = False
        recorder = self._begin_recording(end, probe)
        self.drive_end(end, Pulse(self.measure_rest(end), probe))
        return recorder

    def _begin_recording(self, end: End, probe: ProbeSettings) -> WaveformRecorder:
        recorder = WaveformRecorder(end, probe, self.recent, self._driver.lag)
        self.recorders.append(recorder)
        return recorder

    def drive_end(self, end: End, motion: BoundaryMotion) -> None:
        """Make a boundary cell follow a motion, then release it; nothing listens because of it."""
        self.held = Held(motion, end.site(self._design), 0)
        samples = math.ceil(motion.duration / self._driver.dt)
        self.reverberation[end].ignore_samples(samples + self._lag)

    def release_ends(self) -> None:
        """Release a held cell, and stop listening at both ends."""
        self.held = None
        self.detectors = {}
        self.recorders = []

    # --- the tick ------------------------------------------------------------------------

    def held_cell(self, steps: int, faults: Faults = NO_FAULTS) -> HeldCell | None:
        """Return how a cell is moved during the next steps, or None."""
        if self.held is None:
            return None
        motion, site, begun = self.held
        times = substep_times(steps, self._driver.dt, begun, self._driver.nodes)
        driven = times[times <= motion.duration]
        goes_on = len(driven) == len(times)
        self.held = Held(motion, site, begun + steps) if goes_on else None
        if not len(driven):
            return None
        return apply_transducer_faults(
            HeldCell(site, motion.evaluate_motion(driven)),
            motion.evaluate_motion(np.zeros(1)),
            faults,
        )

    def pass_by(self, n: int, ticks: int) -> None:
        """Take ticks of n samples that are all the same, and stay so."""
        for end, reverberation in self.reverberation.items():
            if end not in self._hums:
                v = float(self.recent[end.row, -1])
                self._hums[end] = reverberation.measure_amplitude(v, n)
            reverberation.pass_by(self._hums[end], n, ticks)

    def record(self, ends: Array, ticks: int = 1, interrupted: bool = False) -> None:
        """Take the displacements of both ends after every step of ticks, shape (2, steps).

        `interrupted` says whether sampling was interrupted within them.
        """
        if End.RIGHT not in self.ends:
            ends = np.stack((ends[0], np.full_like(ends[0], self._design.D_s1)))
        width = self.recent.shape[1]
        known = np.concatenate((self.recent, ends), axis=1)
        self.recent = self._recorded = known[:, -width:].copy()  # a view would keep all
        for end, reverberation in self.reverberation.items():
            reverberation.follow_samples(known[end.row, width - reverberation.memory :], ticks)
        for recorder in self.recorders:
            recorder.take_samples(ends, ticks, interrupted)
        self.interrupted |= bool(self.detectors) and interrupted
        for end, detector in self.detectors.items():
            late = min(self._late[end], ticks)
            self._late[end] -= late
            if late < ticks:
                samples = ends[end.row, late * ends.shape[1] // ticks :]
                detector.feed_displacements(samples - self._rest[end])


def _compute_noise_gain(order: int) -> float:
    """Return the factor of a difference on white noise: the root sum square of its weights."""
    return math.sqrt(math.comb(2 * order, order))


def _find_difference_order(design: Design, dt: float) -> int:
    """Return the least order of a difference of samples that removes motion but not noise."""
    stiffest = max(design.k_s1, design.k_s2) * float(design.alpha.max())
    # of the fastest motion: the upper edge of the pass bands, rounded up to a tenth
    omega = math.ceil(10.0 * pass_band(stiffest)[1]) / 10.0
    motion = 2.0 * math.sin(min(0.5 * omega * dt, 0.5 * math.pi))
    order = 1
    # Take differences until 0.1 % of the fastest motion is left. Beyond order 24, samples are
    # too far apart to distinguish motion from noise.
    while motion**order > 1e-3 * _compute_noise_gain(order) and order < 24:
        order += 1
    return order
