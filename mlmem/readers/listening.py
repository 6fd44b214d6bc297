# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Listening: wait until no wave is on its way, fire a pulse, and record what the ends do.

No pulse is fired while a wave may still arrive that a detector would take for an echo.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ProcedureFailed
from ..instrument.blocks import Procedure, catch_up, pass_ticks, wait, wait_for_strain
from ..instrument.echo import ECHO_TAIL_TIME, Echo, detection_threshold, pulse_duration
from ..instrument.end import End, Shot
from ..instrument.instrument import Instrument
from ..settings import ProbeSettings

if TYPE_CHECKING:
    from ..memory import Memory
    from .register import Forecasts


def wait_for_decay(element: Instrument) -> Procedure[None]:
    """Wait until the strain stands still and no detectable wave is on its way.

    All that was excited must have had the time to reach an end; from then on what the ends have
    seen bounds what they may see (see `reverberation`). Sensor noise never ends, so it raises the
    threshold instead of prolonging the wait, and so does the hum of a shaken element (see
    `measure_vibration`).

    Raises:
        ProcedureFailed: It does not become quiet within `read.settle_timeout`.
    """
    yield from wait_for_strain(element)  # set by hand: the wall may be moving
    yield from catch_up(element)
    element.progress.phase = 'quieting'
    ticks_left = math.ceil(element.settings.read.settle_timeout / element.tick)
    while (decay := _estimate_decay(element))[0]:
        ticks, excited = decay
        if ticks_left <= 0:
            raise ProcedureFailed(f'the element does not come to rest: {excited}')
        ticks = min(ticks, ticks_left)
        ticks_left -= ticks
        yield from pass_ticks(element, ticks)


def try_wait_for_decay(element: Instrument, longest: float) -> Procedure[None]:
    """Wait until no wave is detectable, at most for a given time."""
    end = element.ticks + math.ceil(longest / element.tick)
    while element.ticks < end and not has_decayed(element):
        yield 1


def has_decayed(element: Instrument) -> bool:
    """Whether nothing is on its way that an echo detector would detect."""
    return element.base.is_still and not _estimate_decay(element)[0]


def expected_wait(element: Instrument) -> float:
    """Return how long `wait_for_decay` waits now, at the earliest, for waves that fade as
    expected.
    """
    ticks, _ = _estimate_decay(element)
    return min(ticks * element.tick, element.settings.read.settle_timeout)


def _estimate_decay(element: Instrument) -> tuple[int, str]:
    """Return after how many ticks, at the earliest, no wave is left that an echo detector would
    detect, and what there is until then; 0 if none is left, or the base shakes.
    """
    if not element.base.is_still:
        return 0, ''
    design, transducer, remaining = element.design, element.transducer, 0.0
    for end, each in transducer.reverberation.items():  # what was excited reaches an end by then
        passage = element.passage_time(end)
        remaining = max(remaining, passage - each.returns.since * element.driver.dt)
        # a pulse goes to the wall and back; what a strain excites, anywhere, only goes to an end
        moved = (element.ticks - element.last_moved) * element.tick
        remaining = max(remaining, 0.5 * passage - moved)
    if ticks := math.ceil(remaining / element.tick):
        return ticks, 'it is strained all the time'
    longest, waves = 0, ''
    for end, each in transducer.reverberation.items():
        probe = transducer.probes[end]
        faster = max(0.0, probe.gain_decay - 0.5 * design.eta)  # the threshold falls faster
        limit = probe.v_th * math.exp(-faster * element.passage_time(end))
        limit *= element.settings.read.wave_limit
        if each.returns.bound > limit:
            # the greatest mean of a tick is twice the mean of all where there is noise alone
            limit = max(limit, 2.0 * each.gain * transducer.noise(end))
        ticks = math.ceil(each.count_fading_samples(limit) / element.steps_per_tick)
        if ticks > longest:
            bound, longest = each.returns.bound, ticks
            waves = f'waves of {bound:.2g} may still reach the {end} end; an echo can be heard up '
            waves += f'to {limit:.2g}'
    return longest, waves


def noise_floor(element: Instrument, end: End) -> float:
    """Return the contribution of noise alone to v_c at an end; 0 if negligible.

    That is its mean size in the carrier's band, times a factor for its fluctuation.
    """
    transducer = element.transducer
    noise = transducer.reverberation[end].gain * transducer.noise(end)
    if noise < 0.01 * transducer.probes[end].v_th:
        return 0.0
    return element.settings.read.noise_factor * noise


def measure_vibration(element: Instrument, wanted: Iterable[End]) -> Procedure[dict[End, float]]:
    """Listen to a shaken element without a pulse, and return its contribution to v_c by end.

    It listens for as long as the longest echo takes, so that present waves pass by, and longer
    while they decay.
    """
    element.progress.phase = 'listening'
    factor = element.settings.read.noise_factor
    detectors = {end: element.transducer.listen_only(end) for end in wanted}
    while True:
        yield 1
        amplitudes, done = {}, True
        for end, detector in detectors.items():
            longest = element.passage_time(end)
            # a third of waves with lifetime 2 / eta remains after 500 time units
            span = max(500.0, longest)
            amplitude, before = (factor * detector.find_loudest(span, ago) for ago in (0.0, span))
            # a vibration of 0.3 of the threshold at the last echo raises it by 4 %
            faint = 0.3 * float(detection_threshold(detector.probe, np.array(longest)))
            passed = detector.time >= span and amplitude <= faint
            # decaying waves explain a ratio of up to 0.7 to the previous vibration
            done &= passed or (detector.time >= 2.0 * span and amplitude > 0.7 * before)
            amplitudes[end] = amplitude
        if done:
            element.transducer.release_ends()
            return amplitudes


def probe_ends(element: Instrument, wanted: tuple[End, ...]) -> Procedure[dict[End, Echo]]:
    """Fire a pulse at each of some ends and return the echoes; repeat it if interrupted.

    A real element does not wait: a delay cannot be measured across a break.

    Raises:
        ProcedureFailed: The element does not come to rest, or every attempt was interrupted.
        Astray: An end to be driven rests in neither phase.
    """
    attempts = element.settings.read.attempts
    for _ in range(attempts):
        echoes = yield from _probe_ends_once(element, wanted)
        if not element.transducer.interrupted:
            return echoes
    raise ProcedureFailed(
        f'every attempt to listen was interrupted ({attempts}): set-points came too late, or '
        'samples are missing; relieve processor and line, or let the driver send further ahead'
    )


def _probe_ends_once(element: Instrument, wanted: tuple[End, ...]) -> Procedure[dict[End, Echo]]:
    """Fire the pulses one after the other, the shorter first, and listen to all echoes.

    While the base shakes, hum is measured first. A base that begins to shake after the pulses
    spoils the echoes; noise that begins raises the threshold.
    """
    yield from wait_for_decay(element)
    yield from wait(element, element.settings.read.rest)
    transducer, shaken, spoiled = element.transducer, not element.base.is_still, False
    if shaken:
        floors = yield from measure_vibration(element, wanted)
    else:
        floors = {end: noise_floor(element, end) for end in wanted}
    element.progress.phase = 'listening'
    for end in wanted:
        element.require_phase(end)
    for end in sorted(wanted, key=lambda end: pulse_duration(transducer.probes[end])):
        transducer.fire_probe(end, floors[end])
        while transducer.is_driving:
            yield element.count_ticks_to_check(transducer.remaining_time)
            spoiled |= not (shaken or element.base.is_still)
    detectors = transducer.detectors
    last = {end: element.passage_time(end) + ECHO_TAIL_TIME for end in detectors}
    while (remaining := max(last[end] - each.time for end, each in detectors.items())) > 0.0:
        yield element.count_ticks_to_check(
            min(remaining, ECHO_TAIL_TIME)
        )  # any delay is yet to come; TAIL follows it
        spoiled |= not (shaken or element.base.is_still)
        for end, detector in detectors.items():
            if detector.delay is not None and not spoiled:  # or it comes after the next pulse
                last[end] = min(last[end], detector.delay + ECHO_TAIL_TIME)
    for end, detector in detectors.items():
        detector.raise_noise_floor(0.0 if shaken else noise_floor(element, end))
    strain, dt = element.transmission.encoder_strain, element.driver.dt
    shots = {recorder.end: recorder.shot(0.0, strain, dt) for recorder in transducer.recorders}
    transducer.release_ends()
    return {
        end: detector.build_echo(end, shots[end], shaken=shaken or spoiled, spoiled=spoiled)
        for end, detector in detectors.items()
    }


def wait_until_pinned(element: Instrument) -> Procedure[None]:
    """Wait until the wall swings no more."""
    yield from wait(element, swinging_time(element))


def swinging_time(element: Instrument) -> float:
    """Return how long a wall may still swing; 0 if nothing damps it.

    It swings below the pass band of either phase, so that no end sees it.
    """
    if element.design.eta == 0.0:
        return 0.0
    if not element.base.is_still:  # it was probed as often as may be
        return 0.0
    # A wall swings by half a cell once substrate and ends stand still, which makes an echo 1.5
    # times as large. After ten damping times the swing is below 4e-3 cells.
    return 10.0 / element.design.eta - (element.ticks - element.last_moved) * element.tick


def record_waveforms(element: Memory, forecasts: Forecasts) -> Procedure[tuple[Shot, float]]:
    """Wait until the ends are quiet in the band of the pulse, fire it at the end of the forecasts,
    and record both.

    For an element at rest one look suffices; otherwise a passage.

    Returns:
        The shot, and the noise before it (`Listener.noise`).

    Raises:
        ProcedureFailed: They do not become quiet within `read.settle_timeout`.
        Astray: The end rests in neither phase.
    """
    transducer = element.transducer
    listener, probe = forecasts.listener, element.settings.register.probe
    yield from wait_for_strain(element)
    yield from catch_up(element)
    element.progress.phase = 'quieting'
    deadline = element.ticks + math.ceil(element.settings.read.settle_timeout / element.tick)
    passage = math.ceil(element.passage_time(End.LEFT) / element.tick)
    loudest = noise = listener.noise(transducer.recent, element.driver.dt)
    since = passage if noise < forecasts.max_noise and is_undisturbed(element) else 0
    while since < passage:  # what is inside comes to an end within that time
        before, begin, n = transducer.recent, element.ticks, element.steps_per_tick
        width = before.shape[1]
        yield max(1, min(passage - since, deadline - begin, width // n))
        passed = element.ticks - begin
        samples = np.concatenate((before, transducer.recent[:, max(0, width - passed * n) :]), 1)
        for later in reversed(range(passed)):  # as if every tick had been looked at by itself
            end_of_tick = samples.shape[1] - later * n
            recent = samples[:, end_of_tick - width : end_of_tick]
            noise = listener.noise(recent, element.driver.dt)
            since = since + 1 if noise < forecasts.max_noise else 0
            loudest = loudest if since else noise
        if since < passage and element.ticks >= deadline:
            raise ProcedureFailed(
                'the element does not come to rest: what both ends hear in the band of the pulse '
                f'was {math.sqrt(loudest / forecasts.max_noise):.3g} times as loud as it may be '
                f'{since} ticks ago; they must be quiet for {passage}'
            )
    element.require_phase(forecasts.end)
    return (yield from fire_pulse(element, forecasts.end, probe, listener.ticks)), noise


def fire_pulse(element: Instrument, end: End, probe: ProbeSettings, ticks: int) -> Procedure[Shot]:
    """Fire a pulse at an end of a quiet element, and record both ends for so many ticks."""
    element.progress.phase = 'listening'
    recorder = element.transducer.record_pulse(end, probe)
    yield from pass_ticks(element, ticks + element.driver.lag)
    element.transducer.release_ends()
    return recorder.shot(0.0, element.transmission.encoder_strain, element.driver.dt)


def is_undisturbed(element: Memory) -> bool:
    """Return whether nothing has excited the element for so long that it is still inside."""
    since = min(each.returns.since for each in element.transducer.reverberation.values())
    moved = (element.ticks - element.last_moved) * element.tick
    quiet = min(since * element.driver.dt, moved) * element.design.eta
    # waves have 5e-5 of their amplitude after 20 damping times
    return element.base.is_still and quiet > 20.0
