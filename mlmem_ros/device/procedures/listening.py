# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading: wait for quiet, fire a pulse, listen, decode; from one end or from both."""

from __future__ import annotations

import math

import numpy as np

from ..echo import TAIL, Echo, listening_time, threshold
from ..end import BOTH, End, ends, read_from
from ..errors import ProcedureFailed
from ..instrument import Instrument
from ..memory import Memory
from ..progress import LISTENING, QUIETING
from ..reading import UNDECODABLE, Reading
from . import foreseen
from .blocks import Procedure, Result, catch_up, wait

NOISE_SHARE = 1.25
"""Ratio of unrest to sensor noise up to which an end counts as at rest."""

NEGLIGIBLE = 0.01
"""Negligible noise, as a fraction of the threshold."""

LIFE = 500.0
"""Least time for measuring hum: a third of waves with lifetime 2 / eta remains then."""

FAINT = 0.3
"""Negligible hum, as a fraction of the threshold at the last echo, which it raises by 4 %."""

FALLING = 0.7
"""Largest ratio of hum to the previous one that decaying waves explain."""


def quiet(element: Instrument) -> Procedure[None]:
    """Wait until the strain stands still and both ends are quiet enough for an echo detector.

    Both, because a wave at one end is on its way to the other. If only one is read from, both must
    be as quiet as its detector needs. Sensor noise never ends, so it raises the threshold instead
    of prolonging the wait, and so does the hum of a shaken element (see `hum`).

    Raises:
        ProcedureFailed: They did not become quiet within `read.patience`.
    """
    while element.actuator.moving:  # set by hand: the wall may be moving
        yield element.next_look(element.actuator.left)
    yield from catch_up(element)
    element.progress.phase = QUIETING
    patience = math.ceil(element.settings.read.patience / element.tick)
    while element.base.still and (loud := _loud(element)):
        if patience == 0:
            end, limit = loud
            raise ProcedureFailed(
                f'the {end} end does not come to rest: it moves by '
                f'{element.transducer.unrest(end):.2g}; an echo can be heard up to {limit:.2g}'
            )
        patience -= 1
        yield 1


def settle(element: Instrument, longest: float) -> Procedure[None]:
    """Wait until both ends are quiet, at most for a given time."""
    end = element.ticks + math.ceil(longest / element.tick)
    while element.ticks < end and (_loud(element) or not element.base.still):
        yield 1


def noise_floor(element: Instrument, end: End) -> float:
    """Return the contribution of noise alone to v_c at a quiet end; 0 if negligible.

    That is its mean size, including residual motion, times a factor for its fluctuation.
    """
    transducer = element.transducer
    if transducer.noise(end) < NEGLIGIBLE * transducer.probes[end].v_th:
        return 0.0
    return element.settings.read.noise_factor * transducer.unrest(end)


def hum(element: Instrument, end: End, longest: float) -> Procedure[float]:
    """Listen to a shaken element without a pulse, and return its contribution to v_c.

    It listens for as long as the longest echo takes, so that present waves pass by, and longer
    while they decay.
    """
    element.progress.phase = LISTENING
    factor = element.settings.read.noise_factor
    faint = FAINT * float(threshold(element.transducer.probes[end], np.array(longest)))
    detector, span = element.transducer.listen(end, shaken=True), max(LIFE, longest)
    while True:
        yield 1
        loud, before = (factor * detector.loudest(span, ago) for ago in (0.0, span))
        if detector.time >= span and loud <= faint:
            break
        if detector.time >= 2.0 * span and loud > FALLING * before:
            break
    element.transducer.release()
    return loud


def _loud(element: Instrument) -> tuple[End, float] | None:
    """Return an end that is not quiet, if any, and how much it may move."""
    heard, probes = read_from(element.settings), element.transducer.probes
    for end in probes:
        limit = element.settings.read.quiet * probes[end if end in heard else end.opposite].v_th
        unrest = element.transducer.unrest(end)
        if unrest > limit and unrest > NOISE_SHARE * element.transducer.noise(end):
            return end, limit
    return None


def answer(element: Instrument, end: End, longest: float) -> Procedure[Echo]:
    """Fire a pulse at an end and return the echo; repeat it if listening was interrupted.

    A real element does not wait: a delay cannot be measured across a break. Hum is measured for
    the time of the longest echo.

    Raises:
        ProcedureFailed: The ends do not come to rest, or every attempt was interrupted.
    """
    for _ in range(element.settings.read.attempts):
        echo = yield from _answer(element, end, longest)
        if not element.transducer.interrupted:
            return echo
    raise ProcedureFailed('every attempt to listen was interrupted')


def _answer(element: Instrument, end: End, longest: float) -> Procedure[Echo]:
    """Fire one pulse and return the echo.

    While the base shakes, the carrier is filtered, and hum is measured first. A base that begins
    to shake after the pulse spoils the echo.
    """
    yield from quiet(element)
    yield from wait(element, element.settings.read.rest)
    shaken, spoiled = not element.base.still, False
    floor = (yield from hum(element, end, longest)) if shaken else noise_floor(element, end)
    element.progress.phase = LISTENING
    detector = element.transducer.fire(end, floor, shaken)
    bound = listening_time(element.design, element.transducer.probes[end], end)
    last = bound
    while detector.time < last:  # any delay is yet to come; TAIL follows it
        yield element.next_look(min(last - detector.time, TAIL))
        spoiled |= not (shaken or element.base.still)
        if spoiled:  # or the echo would arrive after the next pulse
            last = bound
        elif detector.delay is not None:
            last = min(last, detector.delay + TAIL)
    element.transducer.release()
    return detector.echo(end, spoiled)


def probe(element: Memory, end: End, left: Reading | None = None) -> Procedure[Reading]:
    """Fire a pulse at an end and return the reading; while the base shakes, repeat until two
    agree.

    The left end's reading just before is combined with that of the right end.
    """
    said: list[int] = []
    while True:
        echo = yield from answer(element, end, element.calibration.longest(end))
        reading = element.hear(echo, left, said)
        understood = reading.level != UNDECODABLE or reading.walls is not None
        if understood or not echo.shaken or len(said) >= element.settings.read.attempts:
            return reading
        element.forget()  # until it is confirmed


def look(element: Memory) -> Procedure[Reading]:
    """Probe from the end in the settings, or from the one that can hear.

    The left end's carrier lies above the band of the inactive phase, so a blank element can only
    be recognised from the right, and vice versa.
    """
    return (yield from probe_from(element, ends(element.settings.read.end)))


def probe_from(element: Memory, wanted: tuple[End, ...]) -> Procedure[Reading]:
    """Probe from an end, or from the left and then the right, if they can hear; see `look`."""
    yield from quiet(element)
    if element.phase(End.LEFT) == 0:
        wanted = (End.RIGHT,)
    elif len(wanted) == 2 and element.phase(End.RIGHT) == 1:
        wanted = (End.LEFT,)
    elif len(wanted) == 2:
        wanted = element.calibration.ends
    reading = None
    for end in wanted:
        reading = yield from probe(element, end, reading)
    assert reading is not None
    return reading


def read(element: Memory, end: str = '') -> Procedure[Result]:
    """Fire a probe pulse from one end, or from both in turn, and decode the echo.

    The end is 'left', 'right' or 'both'; empty means the one in the settings.

    Raises:
        ProcedureFailed: The echo cannot be decoded, or the element does not come to rest.
    """
    pulses = 2 if (end or element.settings.read.end) == BOTH else 1
    foreseen.expect(element, foreseen.reading(element, pulses))
    if end in tuple(End):
        reading = yield from probe(element, End(end))
    else:
        reading = yield from probe_from(element, ends(end or element.settings.read.end))
    if reading.level == UNDECODABLE:
        raise ProcedureFailed(reading.reason)
    return Result(reading)
