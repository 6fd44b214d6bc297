# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hearing: what both ends do after one pulse, as it tells many walls, or one beside a bad cell."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ... import threads
from ..commands import LISTENING, QUIETING
from ..echo import EchoDetector
from ..end import End, Shot
from ..errors import Astray, ProcedureFailed
from ..memory import Memory
from ..peeling import Peeled
from ..reading import Reading
from ..register import Forecasts
from .blocks import Procedure, catch_up

STILL = 20.0
"""Time since the last drive, strain or shock after which nothing runs or swings, times eta: waves
have 5e-5 of their amplitude then."""


def hear(element: Memory) -> Procedure[Reading]:
    """Fire the pulse of a read, of each end that is to be heard, and decode what both ends do;
    raises as `record`.

    Decoding that takes long is done beside the loop. Its answer counts in the tick that
    `register.decode` says, however soon it is there, so a replay has it in the same one.
    """
    forecasts = element.waveforms
    assert forecasts is not None
    shots, loudest = list[Shot](), 0.0
    for end in forecasts.ends:
        try:
            shot, noise = yield from record(element, forecasts, end)
        except Astray as error:
            return element.hear_nothing(str(error))
        shots.append(shot)
        loudest = max(loudest, noise)
    settings = element.settings.register
    detector = EchoDetector(settings.probe, element.driver.dt)
    detector.feed(shots[0].samples[End.LEFT.row] - shots[0].rest[End.LEFT.row])
    phases = element.phase(End.LEFT), element.phase(End.RIGHT)
    decode = partial(forecasts.decode, shots, loudest, phases, settings.min_margin)
    if not settings.decode:
        return element.hear_word(decode(), detector.echo(End.LEFT))
    answer = threads.aside(decode)
    until = element.ticks + math.ceil(settings.decode / element.tick)
    while element.ticks < until:
        yield until - element.ticks
    return element.hear_word(answer.result(), detector.echo(End.LEFT))


def record(
    element: Memory, forecasts: Forecasts | Peeled, end: End = End.LEFT
) -> Procedure[tuple[Shot, float]]:
    """Wait until the ends are quiet in the band of the pulse, fire that of an end, and record
    both. Of an element that rests, a moment tells; otherwise a passage.

    Returns:
        The shot, and the noise before it (`Listener.noise`).

    Raises:
        ProcedureFailed: They do not become quiet within `read.patience`.
        Astray: The end rests in neither phase.
    """
    transducer = element.transducer
    listener, probe = forecasts.listener, element.settings.register.probe
    while element.actuator.moving:
        yield element.next_look(element.actuator.remaining)
    yield from catch_up(element)
    element.progress.phase = QUIETING
    patience = element.ticks + math.ceil(element.settings.read.patience / element.tick)
    passage = math.ceil(element.passage(End.LEFT) / element.tick)
    loud = noise = listener.noise(transducer.recent, element.driver.dt)
    since = passage if noise < forecasts.quiet and undisturbed(element) else 0
    while since < passage:  # what is inside comes to an end within that time
        before, begin, n = transducer.recent, element.ticks, element.steps_per_tick
        width = before.shape[1]
        yield max(1, min(passage - since, patience - begin, width // n))
        passed = element.ticks - begin
        heard = np.concatenate((before, transducer.recent[:, max(0, width - passed * n) :]), 1)
        for later in reversed(range(passed)):  # as if every tick had been looked at by itself
            end_of_tick = heard.shape[1] - later * n
            recent = heard[:, end_of_tick - width : end_of_tick]
            noise = listener.noise(recent, element.driver.dt)
            since = since + 1 if noise < forecasts.quiet else 0
            loud = loud if since else noise
        if since < passage and element.ticks >= patience:
            raise ProcedureFailed(
                'the element does not come to rest: what both ends hear in the band of the pulse '
                f'was {math.sqrt(loud / forecasts.quiet):.3g} times as loud as it may be {since} '
                f'ticks ago; they must be quiet for {passage}'
            )
    element.require_phase(end)
    element.progress.phase = LISTENING
    recorder = transducer.shoot(end, probe)
    until = element.ticks + listener.ticks + element.driver.lag
    while element.ticks < until:
        yield until - element.ticks
    transducer.release()
    return recorder.shot(0.0, element.transmission.encoder, element.driver.dt), noise


def undisturbed(element: Memory) -> bool:
    """Return whether nothing has excited the element for so long that it is still inside."""
    since = min(each.returns.since for each in element.transducer.reverberation.values())
    moved = (element.ticks - element.last_moved) * element.tick
    quiet = min(since * element.driver.dt, moved) * element.design.eta
    return element.base.still and quiet > STILL
