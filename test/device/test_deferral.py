# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Deferral and interleaving: a loop that runs many ticks at once, between commands, accelerations
and calls that come when they like, beside a twin that computes every tick by itself.

A seeded life on a virtual clock: whatever comes takes effect within a tick of its time, and is
told soon; the device is the twin's, by its whole snapshot, and so is all that it reports. Every
tick that somebody waits for is told by itself, and on time if it ends a batch.
"""

import random
from functools import cache

import pytest
from sampled import sampled

from mlmem import (
    Abort,
    Disturb,
    Erase,
    Faults,
    Loop,
    Outcome,
    Read,
    Refused,
    SetFaults,
    SetStrain,
    Write,
)
from mlmem.loop.timetable import MAX_DEFERRAL_S

from . import rig
from .loops import until
from .test_runs import end

PERIOD = 0.002
"""Of a tick: 20 time units of 1e-4 s."""

SAMPLE = (7, 8, 10, 11)
"""Seeds of lives with every pace of streams, every batch and every command between them."""

LIFE = 1.1
"""Seconds."""


class Life:
    """A clock that advances while the loop sleeps on it. At their times things happen, which end
    the sleep only if they wake the loop. In the end it asks for a pause.
    """

    slack = 0.0

    def __init__(self, happens):
        self.time, self.happens = 0.0, sorted(happens, key=lambda each: each[0])

    def now(self):
        return self.time

    def wait(self, changed, seconds):
        """Sleep; called with the lock of `changed` held."""
        until, woken = self.time + seconds, []
        wake, changed.notify_all = changed.notify_all, lambda: woken.append(True)
        while not woken and self.happens and self.happens[0][0] <= until:
            self.time, act = self.happens.pop(0)
            act()
        changed.notify_all = wake
        if not woken:
            self.time = until


@cache
def lived(seed):
    """Live; return the device, what took effect with its tick, and what was told and when."""
    chance, quick = random.Random(seed), rig.device(1)
    taken, told, calls, heard, answers, seen = [], [], [], {}, [], {}
    every, streams = chance.choice([(0, False), (1, True), (7, False), (10, True)])

    def listen(commands, events):
        seen[quick.ticks] = clock.time
        for tick, command in commands:
            taken.append((tick, command))
            heard[id(command)] = tick, clock.time
        told.extend((quick.ticks, event) for event in events)

    def acts(command):
        return lambda: answers.append(loop.submit(command))

    wanted = []
    for _ in range(chance.randint(4, 12)):
        wanted.append((chance.uniform(0.0, 0.8 * LIFE), command_of(chance)))
    for n in range(chance.choice((0, 0, 30))):  # an IMU
        wanted.append((0.3 + 0.0013 * n, Disturb(chance.choice((0.0, 1e-6, -1e-6)))))
    happens = [(when, acts(command)) for when, command in wanted]
    happens += [
        (chance.uniform(0.0, LIFE), lambda: calls.append(loop.call(lambda: quick.ticks)))
        for _ in range(5)
    ]
    happens.append((LIFE, lambda: calls.append(loop.pause(True))))
    clock, batch = Life(happens), chance.choice((1, 5, 10))
    loop = Loop(
        quick, listen, pacer=clock, speed=1.0, batch=batch,
        has_subscribers=lambda: streams, stream_period=lambda: every,
    )  # fmt: skip
    loop.start()
    until(lambda: len(calls) == 6)
    ticks = [call.result(20.0) for call in calls][-1]
    loop.stop()
    refused = {id(each.asked) for each in answers if each.answer.exception(1.0) is not None}
    most = MAX_DEFERRAL_S if not streams else 0.0 if every % batch == 0 else batch * PERIOD
    for tick in range(every, ticks + 1, every) if every else ():
        assert tick in seen, 'somebody waits for it'
        assert abs(seen[tick] - tick * PERIOD) < most + 2 * PERIOD
    return quick, wanted, taken, told, heard, refused, ticks


def command_of(chance):
    """Return a command that comes now and then; most of the time there is rest."""
    return chance.choice((
        Read(), Read('right'), Read(), Write(chance.randrange(3)), Erase(), Abort('enough'),
        SetStrain(chance.choice((0.0, 2e-4))), SetFaults(Faults(sensor_noise=1e-7, seed=3)),
        SetFaults(Faults()), Disturb(chance.choice((0.0, 1e-6, 2e-4))),
    ))  # fmt: skip


@pytest.mark.parametrize(
    'seeds', sampled([list(SAMPLE), range(60)], lambda seeds: len(seeds) < 60)
)
def test_any_run_in_loop_equals_computing_every_tick(seeds):
    found = set()
    for seed in seeds:
        slow = rig.device(1)
        slow.__class__ = rig.Restless
        quick, wanted, taken, told, heard, refused, ticks = lived(seed)
        for when, command in wanted:
            if id(command) in refused or (
                isinstance(command, Disturb) and id(command) not in heard
            ):
                continue  # of the accelerations in a tick the newest counts
            tick, at = heard[id(command)]
            assert abs(tick * PERIOD - when) < PERIOD + 1e-9, 'it took effect in another tick'
            assert at - when < MAX_DEFERRAL_S + 2 * PERIOD, 'it was told too late'
        seen = []
        for tick in range(quick.ticks):
            for stamp, command in taken:
                if stamp == tick:
                    slow.apply(command)
            seen += [(slow.ticks, event) for event in slow.advance()]
        assert abs(ticks - LIFE / PERIOD) < 2
        assert [rig.plain(event) for _, event in told] == [rig.plain(event) for _, event in seen]
        assert [tick for tick, event in told if isinstance(event, Outcome)] == [
            tick for tick, event in seen if isinstance(event, Outcome)
        ]
        assert end(quick) == end(slow)
        found |= {type(command) for _, command in taken}
        found |= {type(event) for _, event in told} | ({Refused} if refused else set())
    # they rest, read, write, shake and are rejected: or nothing above is tried
    assert {Read, Write, Erase, Abort, SetStrain, SetFaults, Disturb, Outcome, Refused} <= found
