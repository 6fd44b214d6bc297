# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs of ticks: a device computes and reports the same, however time is divided."""

import random
from functools import partial

import pytest
from sampled import sampled

from mlmem import (
    Abort,
    Disturb,
    Read,
    Refused,
    Write,
    snapshot,
)
from mlmem.instrument.instrument import MAX_RUN_TICKS
from mlmem.physics import StateError

from . import lives, rig
from .test_hard_lives import MOST_WORK


def live(element, story, last, length):
    """Apply stamped commands in runs of some lengths; return all events with their ticks."""
    told = []
    while element.ticks < last:
        try:
            for command in story.get(element.ticks, ()):
                element.apply(command)
        except Refused as refusal:
            told.append((element.ticks, str(refusal)))
        begun = element.ticks
        due = min([last, *(tick for tick in story if tick > begun)])
        try:
            events = element.advance(min(length(), due - begun))
        except StateError as error:
            told.append((element.ticks, str(error)))
            return told
        if events:
            assert element.ticks == begun + 1
        told += [(element.ticks, *rig.plain(event)) for event in events]
    return told


def end(element):
    """Abort, because only an idle device has a snapshot, and return the whole state."""
    element.apply(Abort())
    while element.procedure:
        element.advance()
    return repr(snapshot.take_snapshot(element)), element.substrate_speed


@pytest.mark.parametrize('seeds', sampled([range(6, 12), range(200)], lambda seeds: seeds[0]))
def test_any_life_is_same_in_runs(seeds):
    """For any legal design, settings and commands, including lost ticks."""
    for seed in seeds:
        chance = random.Random(seed)
        alone, element = lives.device(random.Random(seed)), lives.device(chance)
        if alone is None:
            continue
        ticks = min(60, MOST_WORK // (alone.steps_per_tick * alone.design.N))
        story = {
            tick: [lives.command(chance, alone)] for tick in range(ticks) if chance.random() < 0.15
        }
        expected = live(alone, story, ticks, lambda: 1)
        length = partial(chance.randint, 1, 20)
        assert live(element, story, ticks, length) == expected
        assert element.chain.state().tobytes() == alone.chain.state().tobytes()
        for each in (element, alone):
            each._stop('only an idle device has a snapshot')
        assert repr(snapshot.take_snapshot(element)) == repr(snapshot.take_snapshot(alone))


@pytest.mark.parametrize('rested', [0, 1000], ids=['swinging', 'at rest'])
def test_accelerations_within_run_are_those_of_its_ticks(rested):
    """They come and go, and one is strong enough to move the wall: the content is unknown then."""
    alone, together = rig.device(1), rig.device(1)
    for element in (alone, together):
        rig.succeed(element, Read())
        rig.ticks(element, rested)
        assert element.at_rest == bool(rested)
    shakes = {3: 1e-6, 4: -2e-6, 5: 0.0, 17: 3e-6, 40: -1e-6, 44: 2e-4}
    for tick in range(50):
        if tick in shakes:
            alone.apply(Disturb(shakes[tick]))
        alone.advance()
        assert (alone.reading is None) == (tick >= 44)
    for first, length in ((0, 1), (1, 29), (30, 20)):
        within = {tick - first: a for tick, a in shakes.items() if 0 <= tick - first < length}
        together.advance(length, within)
    assert together.reading is None
    before = snapshot.take_snapshot(together)
    with pytest.raises(Refused):
        together.advance(5, {0: 1e-6, 3: 1.0})
    assert snapshot.take_snapshot(together) == before
    assert end(together) == end(alone)


@pytest.mark.parametrize('begin', sampled(range(12, 40, 3), lambda begin: begin % 6 == 0))
def test_acceleration_is_felt_before_procedure_looks(begin):
    """A single jerk while a read drives its pulses, or listens, may last only for its own tick."""
    alone, together, told = rig.device(1), rig.device(1), ([], [])
    for element in (alone, together):
        element.apply(Read())
    for tick in range(180):
        shakes = {0: {begin: 1e-5, begin + 1: 0.0}[tick]} if tick in (begin, begin + 1) else {}
        if shakes:
            alone.apply(Disturb(shakes[0]))
        told[0].extend(rig.plain(event) for event in alone.advance())
        told[1].extend(rig.plain(event) for event in together.advance(1, shakes))
    assert len(told[0]) >= 2
    assert told[0] == told[1]


@pytest.mark.parametrize('lost', [3, 4, 40])
def test_failing_tick_is_found_within_its_run(lost):
    """A write runs, and the material cannot advance beyond some step."""
    seen = []
    for length in (1, 20, 10**6):
        element = rig.device(1)
        last, advance = lost * element.steps_per_tick, element.driver.advance

        def balk(*inputs, element=element, last=last, advance=advance):
            steps = len(inputs[0]) // len(element.driver.nodes)
            if element.chain.steps_done + steps > last:
                raise StateError('no further')
            return advance(*inputs)

        element.driver.advance = balk
        told = live(element, {0: [Write(3)]}, 60, lambda length=length: length)
        assert element.ticks == lost
        assert told[-1] == (lost, 'no further')
        element.driver.advance = advance
        seen.append((told, element.advance(), end(element)))
    assert repr(seen[0]) == repr(seen[1]) == repr(seen[2])


def test_predictable_ticks_are_computed_in_one_call():
    """All of a write except its reads, in less than a fifth of the number of ticks."""
    element = rig.device(1)
    asked, advance = [], element.driver.advance

    def count(*inputs):
        asked.append(len(inputs[0]) // (len(element.driver.nodes) * element.steps_per_tick))
        return advance(*inputs)

    element.driver.advance = count
    element.reading = rig.succeed(rig.device(1), Read())  # so that it need not look first
    outcome = element.perform(Write(3))
    assert outcome.success
    assert sum(asked) == element.ticks
    assert max(asked) == MAX_RUN_TICKS
    assert len(asked) < 0.2 * element.ticks
