# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Any cut of time gives the same bits: runs of ticks, rests, and ticks that a loop defers.

Seeded runs of any legal element beside a slow twin that computes every tick by itself.
"""

import dataclasses
import random
from functools import partial

import legal
import numpy as np
import pytest
import rig
from loops import PERIOD, Clock, until
from suite import sampled

from mlmem import (
    Abort,
    Calibrate,
    Calibration,
    DelayTable,
    Disturb,
    Erase,
    Faults,
    FollowTrajectory,
    Kick,
    Loop,
    MemoryElement,
    Outcome,
    Read,
    Refused,
    SelfTest,
    SetFaults,
    SetStrain,
    SettingsError,
    Write,
    load_element,
    snapshot,
)
from mlmem.instrument.blocks import MAX_RUN_TICKS
from mlmem.instrument.end import End, EndMove, Pulse
from mlmem.instrument.instrument import Instrument
from mlmem.loop.timetable import Timetable
from mlmem.physics import StateError
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.settings import ActuatorSettings


def draw_device(random):
    """Return a device of a legal design and settings, or None if it is refused."""
    design = legal.design(random)
    table = DelayTable(tuple(level + 1.0 for level in range(design.levels)))
    try:
        return MemoryElement(design, legal.settings(random), Calibration(table, table))
    except SettingsError:  # a tick or a rest that would take too long
        return None


def draw_strain(random, element):
    limit = element.settings.actuator.max_strain
    return random.choice((-limit, 0.0, limit, random.uniform(-limit, limit)))


def draw_trajectory(random, element):
    times = sorted(legal.number(random, 0.0, 1e300) for _ in range(random.randint(1, 4)))
    rates = [legal.number(random, -1e300, 1e300) for _ in times if random.random() < 0.9]
    return FollowTrajectory(times, [draw_strain(random, element) for _ in times], rates)


def draw_faults(random, element):
    drawn = legal.values(random, Faults, 0.3)
    last = element.design.N
    cells = {'weak_cell': random.randint(0, last), 'stuck_cell': random.randint(0, last)}
    return SetFaults(Faults(**(drawn | cells)))


def draw_command(random, element):
    """Return any command, the wildest ones included."""
    limit = element.settings.disturbance.max_acceleration
    return random.choice((
        lambda: SetStrain(draw_strain(random, element)),
        lambda: draw_trajectory(random, element),
        lambda: Disturb(random.choice((-limit, limit, random.uniform(-limit, limit)))),
        lambda: draw_faults(random, element),
        lambda: Write(random.randrange(element.design.levels)),
        lambda: Read(random.choice(('', 'left', 'right', 'both'))),
        lambda: random.choice((Erase(), Calibrate(), SelfTest())),
        lambda: Kick(10.0 ** random.uniform(-4.0, 1.0)),
        lambda: Abort('enough'),
    ))()  # fmt: skip


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


def assert_sound(element):
    """Assert that all numbers are finite, and that an idle device survives a snapshot."""
    assert np.isfinite(element.chain.state()).all()
    assert np.isfinite(element.transducer.recent).all()
    assert np.isfinite(energy(element.chain).total)
    snapshot.restore_snapshot(element, rig.save_state(element))


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('seeds', sampled([range(5, 12), range(2000)], lambda seeds: seeds[0]))
def test_any_legal_run_is_the_same_for_any_cut_of_time(seeds):
    """For legal designs, settings and commands, including lost ticks; the device stays sound."""
    for seed in seeds:
        chance = random.Random(seed)
        alone, element = draw_device(random.Random(seed)), draw_device(chance)
        if alone is None:
            continue
        # a run computes at most a million steps times cells
        ticks = min(60, 1_000_000 // (alone.steps_per_tick * alone.design.N))
        story = {
            tick: [draw_command(chance, alone)] for tick in range(ticks) if chance.random() < 0.15
        }
        expected = live(alone, story, ticks, lambda: 1)
        length = partial(chance.randint, 1, 20)
        assert live(element, story, ticks, length) == expected
        assert element.chain.state().tobytes() == alone.chain.state().tobytes()
        for each in (element, alone):
            each._abort_procedure('only an idle device has a snapshot')
            assert_sound(each)
        assert repr(snapshot.take_snapshot(element)) == repr(snapshot.take_snapshot(alone))


@pytest.mark.parametrize('rested', [0, 1000], ids=['swinging', 'at rest'])
def test_accelerations_within_a_run_are_those_of_its_ticks(rested):
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


@pytest.mark.parametrize('lost', [3, 4, 40])
def test_failing_tick_is_found_within_its_run(lost):
    """A write runs, and the material cannot advance beyond some step: the write then ends."""
    seen = []
    for length in (1, 20, 10**6):
        element = rig.device(1)
        last, advance = lost * element.steps_per_tick, element.driver.advance

        def balk(*inputs, element=element, last=last, advance=advance):
            steps = len(inputs[0]) // len(element.driver.nodes)
            if element.chain.steps_done + steps > last:
                raise StateError(reason='no further')
            return advance(*inputs)

        element.driver.advance = balk
        told = live(element, {0: [Write(3)]}, 60, lambda length=length: length)
        assert element.ticks == lost
        assert told[-1] == (lost, 'no further')
        element.driver.advance = advance
        (outcome,) = element.advance()
        ended = (outcome.procedure, outcome.success, outcome.error)
        assert ended == ('write', False, 'no further')
        assert element.reading is None
        seen.append((told, outcome, end(element)))
    assert repr(seen[0]) == repr(seen[1]) == repr(seen[2])


def test_predictable_ticks_are_computed_in_one_call():
    """All of a write except its reads, in less than a fifth of the number of ticks."""
    element = rig.device(1)
    asked, advance = [], element.driver.advance

    def count(*inputs):
        asked.append(len(inputs[0]) // (len(element.driver.nodes) * element.steps_per_tick))
        return advance(*inputs)

    element.driver.advance = count
    element.reading = rig.succeed(rig.device(1), Read()).reading  # so that it need not look first
    rig.succeed(element, Write(3))
    assert sum(asked) == element.ticks
    assert max(asked) == MAX_RUN_TICKS
    assert len(asked) < 0.2 * element.ticks


def test_device_can_be_saved_and_goes_on_after_lost_tick():
    """In a tick the actuator strains the element by more than its cells can follow, while its base
    shakes.
    """
    hasty = ActuatorSettings(max_strain=0.5, max_rate=1.0)
    element, other = rig.device(3, actuator=hasty), rig.device(actuator=hasty)
    rig.ticks(element, 5, Disturb(1e-6), SetStrain(0.5))
    with pytest.raises(StateError, match=r'left the range|stopped being finite'):
        rig.ticks(element, 5)
    assert element.is_still
    assert rig.true_level(element) == 3
    snapshot.restore_snapshot(other, snapshot.take_snapshot(element))
    for each in (element, other):
        rig.ticks(each, 20)
    assert rig.bits(other)[0] == rig.bits(element)[0]
    rig.succeed(element, Read('both'))


def make_restless(kind):
    """Return the slow twin of a class: it passes every tick as if something moved."""
    return type('Restless', (kind,), {'at_rest': False})


SHORT = dataclasses.replace(load_element('bits_1').design, eta=0.2)
"""So damped that it rests some ticks after whatever moved it."""


def drawn(chance):
    """Return something that is done to an instrument: many are so faint that nothing moves."""
    end, A = chance.choice(list(End)), chance.choice((1e-9, 1e-3))
    faint, strain = chance.random() < 0.7, chance.choice((0.0, 1e-4))
    noisy = Faults(sensor_noise=1e-7, sensor_end=chance.choice(('both', 'right')))
    faults = noisy if chance.random() < 0.5 else Faults()
    shake = chance.choice((0.0, 1e-7))

    def pulse(made):
        probe = dataclasses.replace(made.transducer.probes[end], A=A, sigma=2.0)
        made.transducer.drive_end(end, Pulse(made.transducer.measure_rest(end), probe))

    def stay(made):
        """Hold an end where it is."""
        here = made.driver.end(end.site(SHORT))
        made.transducer.drive_end(end, EndMove(here, here, 0.01))

    return chance.choice((
        pulse, stay,
        lambda made: stay(made) if faint else made.transducer.fire_probe(end),
        lambda made: made.transducer.record_pulse(end, made.transducer.probes[end]),
        lambda made: made.transducer.listen_only(end),
        lambda made: made.actuator.slew_to(strain),
        lambda made: made.base.accept_acceleration(shake),
        lambda made: made.set_faults(faults),
    ))  # fmt: skip


def release(made):
    """End all that keeps an element from its rest."""
    made.transducer.release_ends()
    made.base.accept_acceleration(0.0)
    made.set_faults(Faults())


def whole(made):
    """Return all that ticks change."""
    transducer, chain = made.transducer, made.chain
    return (
        made.ticks, made.last_moved, made.substrate_speed, made.base.state, made.actuator.state,
        made.transmission.state, chain.state().tobytes(), chain.V_N, chain.steps_done,
        transducer.recent.tobytes(), transducer.held is None, transducer.remaining_time,
        {end: each.returns for end, each in transducer.reverberation.items()},
        {end: (each.time, each.delay) for end, each in transducer.detectors.items()},
        [each.shot(0.0, 0.0, 0.5).samples.tobytes() for each in transducer.recorders],
    )  # fmt: skip


@pytest.mark.parametrize('seeds', sampled([(0, 2), range(300)], lambda seeds: len(seeds) == 2))
def test_any_rest_of_instrument_equals_computing_every_tick(seeds):
    """Rests begin, and end, at every phase of a pulse, a strain, a shake and a fault, in runs of
    any length; what is driven too faintly to move anything is driven and heard all the same.
    """
    for seed in seeds:
        chance = random.Random(seed)
        quick, slow = (
            rig.settle(
                kind(SHORT, load_element('bits_1').settings), find_pinned_wall(SHORT, seed % 2)
            )
            for kind in (Instrument, make_restless(Instrument))
        )
        rests = 0
        for left in reversed(range(15)):
            acts, runs = [drawn(chance)], [chance.choice((1, 2, 3, 7)) for _ in range(4)]
            if left == 0 or chance.random() < 0.4:
                acts, runs = [release, *acts] if left else [release], [*runs, 60]
            for made in (quick, slow):
                for act in acts:
                    act(made)
            for ticks in runs:
                quick.pass_ticks(ticks)
                for _ in range(ticks):
                    slow.pass_ticks()
                assert whole(quick) == whole(slow)
                rests += quick.at_rest
        assert rests


def lived(seed):
    """Live for 0.8 s, and pause in the end, all on time; return the device, what took effect with
    its tick, what was told and when, and whether something was refused.
    """
    chance, quick, life = random.Random(seed), rig.device(1), 0.8
    taken, told, calls, heard, answers, seen = [], [], [], {}, [], {}
    every, streams = chance.choice([(0, False), (1, True), (7, False), (10, True)])

    def listen(commands, events):
        seen[quick.ticks] = clock.time
        for tick, command in commands:
            taken.append((tick, command))
            heard[id(command)] = tick, clock.time
        told.extend((quick.ticks, event) for event in events)

    def submit(when, command):
        return when, lambda: answers.append((when, loop.submit(command)))

    happens = [
        submit(chance.uniform(0.0, 0.8 * life), command_of(chance))
        for _ in range(chance.randint(4, 12))
    ]
    for n in range(chance.choice((0, 0, 30))):  # an IMU
        happens.append(submit(0.3 + 0.0013 * n, Disturb(chance.choice((0.0, 1e-6, -1e-6)))))
    for _ in range(5):
        when = chance.uniform(0.0, life)
        happens.append((when, lambda: calls.append(loop.call(lambda: quick.ticks))))
    happens.append((life, lambda: calls.append(loop.pause(True))))
    clock, batch = Clock(happens), chance.choice((1, 5, 10))
    loop = Loop(
        quick, listen, pacer=clock, speed=1.0, batch=batch,
        has_subscribers=lambda: streams, stream_period=lambda: every,
    )  # fmt: skip
    loop.start()
    until(lambda: len(calls) == 6)
    ticks = [call.result(20.0) for call in calls][-1]
    loop.shut_down()
    assert loop.statistics.overruns == 0
    assert abs(ticks - life / PERIOD) < 2
    refused = False
    for when, request in answers:
        if request.answer.exception(1.0) is not None:
            refused = True
        elif id(request.asked) in heard or not isinstance(request.asked, Disturb):
            tick, at = heard[id(request.asked)]  # of the accelerations in a tick the newest counts
            assert abs(tick * PERIOD - when) < PERIOD + 1e-9, 'it took effect in another tick'
            assert at - when < Timetable.max_deferral + 2 * PERIOD, 'it was told too late'
    most = Timetable.max_deferral if not streams else 0.0 if every % batch == 0 else batch * PERIOD
    for tick in range(every, ticks + 1, every) if every else ():
        assert tick in seen, 'somebody waits for it'
        assert abs(seen[tick] - tick * PERIOD) < most + 2 * PERIOD
    return quick, taken, told, refused


def command_of(chance):
    """Return a command that comes now and then; most of the time there is rest."""
    return chance.choice((
        Read(), Read('right'), Read(), Write(chance.randrange(3)), Erase(), Abort('enough'),
        SetStrain(chance.choice((0.0, 2e-4))), SetFaults(Faults(sensor_noise=1e-7, seed=3)),
        SetFaults(Faults()), Disturb(chance.choice((0.0, 1e-6, 2e-4))),
    ))  # fmt: skip


@pytest.mark.parametrize(
    'seeds', sampled([[7, 8, 10, 11], range(60)], lambda seeds: len(seeds) < 60)
)
def test_any_run_in_loop_equals_computing_every_tick(seeds):
    """Those of the sample have every pace of streams, every batch and every command."""
    found = set()
    for seed in seeds:
        slow = rig.device(1)
        slow.__class__ = make_restless(MemoryElement)
        quick, taken, told, refused = lived(seed)
        seen = []
        for tick in range(quick.ticks):
            for stamp, command in taken:
                if stamp == tick:
                    slow.apply(command)
            seen += [(slow.ticks, event) for event in slow.advance()]
        assert [rig.plain(event) for _, event in told] == [rig.plain(event) for _, event in seen]
        assert [tick for tick, event in told if isinstance(event, Outcome)] == [
            tick for tick, event in seen if isinstance(event, Outcome)
        ]
        assert end(quick) == end(slow)
        found |= {type(command) for _, command in taken}
        found |= {type(event) for _, event in told} | ({Refused} if refused else set())
    # they rest, read, write, shake and are rejected: or nothing above is tried
    assert {Read, Write, Erase, Abort, SetStrain, SetFaults, Disturb, Outcome, Refused} <= found
