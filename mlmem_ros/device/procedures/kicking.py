# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many walls: kick each to its level, push all out, and hear them in one pulse; without strain.

A kick is a smooth move of the left end to its other ground state. It sends a wall, or a kink
behind walls that rest already, to the level that its speed selects. So a word is filled from the
right.
"""

from __future__ import annotations

import math

from ...physics import Design
from ..commands import LISTENING, QUIETING
from ..echo import EchoDetector, pulse_duration
from ..end import End, Shot
from ..errors import ProcedureFailed
from ..memory import Memory
from ..peeling import Peeled
from ..reading import UNDECODABLE, Reading
from ..register import Code, Forecasts, Register
from ..settings import Settings
from .blocks import Procedure, Result, bring_back, catch_up, fire_push, kick_to, wait
from .filling import annihilate, shift_in


def send(element: Memory, speed: float) -> Procedure[None]:
    """Send a wall, or a kink if the left end is active, to the level of a speed."""
    yield from catch_up(element)
    if element.phase(End.LEFT) is None:
        yield from bring_back(element, End.LEFT)
    design = element.design
    target = design.D_s1 if element.phase(End.LEFT) == 1 else design.D_s2
    yield from kick_to(element, target, speed)


def push_all(element: Memory) -> Procedure[None]:
    """Bring back ends that strayed, fire a loud pulse that takes all walls out, and let its waves
    decay.
    """
    yield from catch_up(element)
    for end in End:
        if element.phase(end) is None:
            yield from bring_back(element, end)
    yield from fire_push(element)
    yield from wait(element, element.settings.push.settle)


def put(element: Memory, register: Register | Peeled, present: int, word: int) -> Procedure[None]:
    """Bring a word into an element that holds another, open loop.

    Walls stay if none is to their right that must go, and none is missing there. Otherwise all
    are pushed out. In a register that is shifted all annihilate, and the word is shifted in.
    """
    if register.code.odd:
        yield from annihilate(element, register.code, present)
        yield from shift_in(element, register.code.walls(word))
        return
    pushed, speeds = way(element.settings, register.code, present, word)
    if pushed:
        yield from push_all(element)
    for speed in speeds:
        yield from send(element, speed)


def way(settings: Settings, code: Code, present: int, word: int) -> tuple[bool, list[float]]:
    """Return whether to push all walls out first, and the speeds of the kicks from there on."""
    wanted = code.walls(word)
    kept = () if present == UNDECODABLE else code.walls(present)
    pushed = present == UNDECODABLE or wanted[len(wanted) - len(kept) :] != kept
    first = 0 if pushed else len(kept)
    speeds = settings.kick.by_level, settings.kick.of_kinks
    return pushed, [speeds[k % 2][wanted[-1 - k]] for k in range(first, len(wanted))]


def duration(design: Design, settings: Settings, pushed: bool, speeds: list[float]) -> float:
    """Return how long that takes, in time units."""
    moved = abs(design.D_s2 - design.D_s1)
    kick, loud = settings.kick, settings.push
    kicks = sum(moved / speed + kick.hold + kick.settle for speed in speeds)
    return kicks + pushed * (pulse_duration(loud) + loud.settle)


def clear(element: Memory) -> Procedure[Result]:
    """Push all walls out, and listen.

    Raises:
        ProcedureFailed: The element is not blank after `write.attempts` pulses.
    """
    attempts, register = element.settings.write.attempts, element.register
    assert register is not None
    for attempt in range(1, attempts + 1):
        element.progress.tried('erase', attempt)
        if register.code.odd:
            present = element.reading.level if element.reading else UNDECODABLE
            yield from annihilate(element, register.code, present)
        else:
            yield from push_all(element)
        reading = yield from hear(element)
        if reading.level == 0:
            return Result(reading, attempt)
    how = 'passages' if register.code.odd else 'pulses'
    raise ProcedureFailed(
        f'the element is not blank after {attempts} {how}: {reading.reason or reading.code}',
        attempts,
    )


def hear(element: Memory) -> Procedure[Reading]:
    """Fire the pulse of a read, of each end that is to be heard, and decode what both ends do;
    raises as `record`.
    """
    forecasts = element.waveforms
    assert forecasts is not None
    shots, loudest = list[Shot](), 0.0
    for end in forecasts.ends:
        shot, noise = yield from record(element, forecasts, end)
        shots.append(shot)
        loudest = max(loudest, noise)
    detector = EchoDetector(element.settings.register.probe, element.driver.dt)
    detector.feed(shots[0].samples[End.LEFT.row] - shots[0].rest[End.LEFT.row])
    return element.hear_word(shots, loudest, detector.echo(End.LEFT))


def record(
    element: Memory, forecasts: Forecasts | Peeled, end: End = End.LEFT
) -> Procedure[tuple[Shot, float]]:
    """Wait until the ends are quiet in the band of the pulse, fire that of an end, and record
    both.

    Returns:
        The shot, and the noise before it (`Listener.noise`).

    Raises:
        ProcedureFailed: They do not become quiet within `read.patience`.
    """
    transducer = element.transducer
    listener, probe = forecasts.listener, element.settings.register.probe
    while element.actuator.moving:
        yield element.next_look(element.actuator.remaining)
    yield from catch_up(element)
    element.progress.phase = QUIETING
    patience = element.ticks + math.ceil(element.settings.read.patience / element.tick)
    since, passage = 0, math.ceil(element.passage(End.LEFT) / element.tick)
    while since < passage:  # what is inside comes to an end within that time
        yield 1
        noise = listener.noise(transducer.recent, element.driver.dt)
        since = since + 1 if noise < forecasts.quiet else 0
        if element.ticks >= patience:
            raise ProcedureFailed(
                'the element does not come to rest: what both ends hear in the band of the pulse '
                f'is {math.sqrt(noise / forecasts.quiet):.3g} times as loud as it may be'
            )
    element.progress.phase = LISTENING
    recorder = transducer.shoot(end, probe)
    until = element.ticks + listener.ticks + element.driver.lag
    while element.ticks < until:
        yield until - element.ticks
    transducer.release()
    return recorder.shot(0.0, element.transmission.encoder, element.driver.dt), noise
