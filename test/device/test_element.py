# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The device between its ticks: what it accepts and rejects, its progress, and its statistics; and
its snapshots: a device from plain values, bit by bit, and values of no such device.
"""

import copy
import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest
import rig
from suite import expect_rejection

from mlmem import (
    BLANK,
    Abort,
    Calibrate,
    Disturb,
    Erase,
    Faults,
    FollowTrajectory,
    Kick,
    Read,
    Refused,
    SetFaults,
    SetStrain,
    Unknown,
    Write,
    snapshot,
)
from mlmem.instrument.end import End
from mlmem.instrument.instrument import Progress
from mlmem.parsing import encode_value
from mlmem.physics import CASE_II, Specimen, StateError, stable_step
from mlmem.physics.pefrl import MAX_ACCURATE_STEP
from mlmem.readers.listening import has_decayed


@pytest.mark.parametrize('tick', [20.0, 0.1, 7.3, 333.0])
@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
def test_tick_is_whole_number_of_stable_steps(tick, substrate):
    design = dataclasses.replace(rig.DESIGN, substrate=substrate)
    element = rig.device(design=design, time={'tick': tick})
    steps, dt = element.steps_per_tick, element.chain.dt
    assert steps * dt == pytest.approx(tick, rel=1e-14)
    largest = min(MAX_ACCURATE_STEP, stable_step(Specimen(design)))
    assert dt <= largest
    assert steps == 1 or tick / (steps - 1) > largest, 'fewer steps would do'
    element.advance()
    assert (element.ticks, element.chain.steps_done) == (1, steps)
    assert element.chain.time == pytest.approx(tick)


BAD = {
    'strain': [*map(SetStrain, (
        math.nan, math.inf, -0.081, '0.01', math.nextafter(0.08, 1.0), 10**400, True, None,
    ))],
    'acceleration': [*map(Disturb, (math.nan, math.inf, 0.0101, -0.0101, 'x', True, None))],
    'level': [*map(Write, (4, -1, 1.0, True, '3', None, math.nan))],
    'speed': [*map(Kick, (0.0, 'fast'))],
    'end': [*map(Read, ('top', None, ['left']))],
    'command': ['write', None, {'kind': 'Write', 'level': 1}],
}  # fmt: skip
"""Commands, by the field that is wrong."""


@pytest.mark.parametrize('field', BAD)
def test_bad_command_is_rejected_and_changes_nothing(written, field):
    element = written(2)
    rig.ticks(element, SetStrain(0.01), 2)
    before = rig.bits(element)
    for command in BAD[field]:
        with expect_rejection(Refused, 'out_of_range', field):
            element.apply(command)
        assert rig.bits(element) == before, command


@pytest.mark.parametrize('running', [Write(3), Erase(), Read(), Calibrate(), Abort()], ids=str)
def test_busy_device_refuses_commands_and_goes_on_unchanged(written, running):
    """Nor is it saved or restored."""
    disturbed, alone, idle = written(2), written(2), snapshot.take_snapshot(written(1))
    for element in (disturbed, alone):
        if running == Abort():  # one that has something to do
            rig.ticks(element, SetStrain(0.01), 10)
        rig.ticks(element, running, 7)
    before = rig.bits(disturbed)
    trajectory = FollowTrajectory((0.1,), (0.01,))
    for command in (SetStrain(0.0), trajectory, Write(1), Read(), Erase(), Calibrate()):
        with expect_rejection(Refused, 'busy'):
            disturbed.apply(command)
        assert rig.bits(disturbed) == before
    for action, *given in ((snapshot.take_snapshot,), (snapshot.restore_snapshot, idle)):
        with expect_rejection(Refused, 'busy'):
            action(disturbed, *given)
        assert rig.bits(disturbed) == before
    assert rig.ticks(disturbed, 20) == rig.ticks(alone, 20)
    assert rig.bits(disturbed) == rig.bits(alone)


def test_strain_by_hand_makes_content_unknown_once(written):
    element = written(3)
    element.apply(SetStrain(0.0))  # as a loop sends it just after a procedure
    assert not element.actuator.is_moving
    assert element.advance() == []
    assert element.reading.level == 3
    since = element.ticks
    assert element.is_released
    element.apply(SetStrain(0.001))
    assert not element.is_released  # it moves, though its strain is still zero
    assert element.reading is None
    assert element.advance() == [Unknown('strained by hand', since)]
    element.apply(SetStrain(0.002))
    assert element.advance() == [], 'it is reported once'
    assert str(element.unknown) == f'unknown since tick {since}: strained by hand'


def test_command_that_may_move_wall_makes_unknown(written):
    """And what cannot move it is not: a fault of a sensor, a shake that is weak, an idle abort."""
    harmless = written(3)
    for command in (SetFaults(Faults(sensor_noise=1e-6)), Disturb(1e-6), Abort()):
        assert not any(isinstance(event, Unknown) for event in rig.ticks(harmless, command, 5))
        assert harmless.reading.level == 3
    for command, reason in (
        (SetFaults(Faults(weak_cell=3)), 'faults were set'),
        (Disturb(2e-4), 'shaken'),
    ):
        element = written(3)
        element.apply(command)
        assert element.advance(9) == [Unknown(reason, element.unknown.since)]
    held = written(3)
    rig.ticks(held, SetStrain(0.001), 300)
    assert rig.succeed(held, Read()).reading.level == 3
    held.apply(Abort())
    assert held.unknown.reason == 'aborted'


def test_listening_ends_after_echo_or_when_none_can_come():
    """150 time units after the last crossing; or after a tenth more than the longest echo."""
    *echoes, _ = rig.events(rig.device(0), Read())
    right = next(each.echo for each in echoes if each.echo.end == 'right')  # level 0 is far
    assert right.t[-1] == pytest.approx(right.delay + 150.0, abs=20.0)
    deaf = rig.device(0, probe={'v_th': 0.9})
    *echoes, outcome = rig.events(deaf, Read())
    assert outcome.error == 'no echo came back'
    left = next(each.echo for each in echoes if each.echo.end == 'left')
    longest = 1.1 * deaf.calibration.table(left.end).longest_delay
    assert left.t[-1] == pytest.approx(longest + 150.0, abs=25.0)


def watched(element, command):
    """Perform a command; return the feedback after every tick, and the outcome."""
    told = []
    outcome = element.perform(command, lambda: told.append(element.get_feedback()))
    return told, outcome


def phases(told):
    return [phase for phase, _ in itertools.groupby(each.phase for each in told)]


@pytest.mark.parametrize(
    ('content', 'command'),
    [(1, Write(2)), (1, Write(1)), (1, Write(3)), (1, Read('both')), (BLANK, Write(0))],
)
def test_share_rises_to_about_one(written, content, command):
    told, outcome = watched(written(content), command)
    shares = [each.share for each in told]
    assert outcome.success
    assert shares == sorted(shares)
    assert 0.75 <= shares[-1] <= 1.0
    assert shares[len(shares) // 2] < 0.7
    if command == Write(2):
        assert phases(told)[:2] == ['straining', 'settling']
        strained = [each.strain for each in told if each.phase == 'straining']
        assert max(map(abs, strained)) > 0.02
    assert ('launching' in phases(told)) == (content == BLANK)
    assert phases(told)[-1] == 'listening'
    assert told[-1].strain == 0.0


def test_failed_attempt_is_counted_and_prolongs_write(written):
    element = written(1, write={'tension': 0.001, 'attempts': 2})  # a pull that no wall follows
    told, outcome = watched(element, Write(2))
    assert not outcome.success
    assert [count for count, _ in itertools.groupby(each.attempts for each in told)] == list(
        range(1, outcome.attempts + 1)
    )
    begun = next(index for index, each in enumerate(told) if each.attempts == 2)
    assert told[begun].share < told[begun - 1].share


def test_late_procedure_has_share_of_one():
    progress = Progress('read', 100)
    progress.expect_end(110)
    assert progress.find_elapsed_share(105) == 0.5
    assert progress.find_elapsed_share(110) == progress.find_elapsed_share(200) == 1.0
    progress.expect_end(300)
    progress.expect_end(250)  # of a procedure that it calls, which ends within that time
    assert progress.find_elapsed_share(200) == 0.5
    progress.record_attempts('erase', 3)  # that of a procedure that it calls
    assert progress.attempts == 1


@pytest.mark.parametrize(
    ('write', 'max_strain', 'expected'),
    [
        ({'escalation': 1.2, 'escalation_limit': 1.5}, 0.08, [1.0, 1.2, 1.44, 1.5]),
        ({'escalation': 1.5, 'escalation_limit': 4.0}, 0.0121, [1.0, 1.21, 1.21, 1.21]),
    ],
    ids=['escalation', 'actuator'],
)
def test_force_is_bounded_and_reset_for_next_write(write, max_strain, expected):
    weak = {'compression': -0.01, 'tension': 0.01, 'start_strain': 0.01}
    element = rig.device(
        1,
        actuator={'max_strain': max_strain},
        write={'attempts': 4} | weak | write,
        erase=weak | {'start_strain': -0.01},
    )
    for _ in range(2):
        peaks = rig.cycles(rig.strains(element, Write(2))[0])
        assert np.divide(peaks, 0.01) == pytest.approx(expected, rel=1e-12)


def test_history_of_element_is_counted():
    """A blank element is read from its right end, whichever is asked; not in loud noise."""
    element = rig.device(1, write={'tension': 0.034})
    for command in (Write(2), Write(2), Read(), Read('left'), Write(1), Erase(), Read('left')):
        element.perform(command)
    element.apply(SetFaults(Faults(sensor_noise=0.01)))  # as loud as the pulse
    assert element.perform(Read()).code == 'undecodable'
    rig.ticks(element, SetFaults(Faults()), Write(3), 10)
    element.perform(Abort())
    counted = element.statistics
    assert (counted.writes, counted.first_try, counted.retries, counted.failures) == (3, 2, 1, 0)
    assert (counted.reads, counted.undecodable) == (4, 1)  # the last in noise
    assert (counted.erases, counted.aborted) == (1, 1)
    assert counted.level_writes == [0, 1, 2, 0]
    assert counted.cycles >= 2 + 2 + 1
    _, one, two, _ = counted.level_ticks
    assert counted.mean_ticks == {1: one, 2: two / 2}
    failing = rig.device(1, write={'tension': 0.005, 'attempts': 2})
    assert failing.perform(Write(2)).code == 'failed'
    counted = failing.statistics
    assert (counted.writes, counted.failures, counted.retries) == (1, 1, 1)
    assert counted.level_writes == [0] * 4


def elastic():
    """Return a device over an elastic substrate that is being compressed; a rigid one's delays."""
    soft = dataclasses.replace(CASE_II, N=75, substrate='elastic', s_min=100.0, s_max=300.0)
    element = rig.device(1, design=soft)
    rig.ticks(element, SetStrain(-0.03), 7)
    return element


def written_and_moving():
    """Return a device that was written and read, and is being strained by hand."""
    element = rig.device()
    rig.succeed(element, Write(3))
    rig.ticks(element, SetStrain(0.03), 7)
    assert element.actuator.is_moving
    return element


def all_active():
    """Return a device whose wall has left, so that its distance is infinite."""
    element = rig.settle(rig.device(), np.full(rig.DESIGN.N, CASE_II.D_s2))
    assert not element.perform(Read()).success
    assert element.reading.distance == math.inf
    return element


def on_a_trajectory():
    element = rig.device(1)
    through = FollowTrajectory((0.1, 0.2, 0.4), (0.05, -0.01, 0.0), (0.0, -0.5, 0.0))
    rig.ticks(element, through, 60)
    return element


def shaken():
    """Return a device between two accelerations; its time-out comes within 100 ticks."""
    element = rig.device(1)
    rig.ticks(element, Disturb(1e-4), 1, Disturb(-2e-4), 3)
    return element


def pulsed():
    """Return a device in which the pulses of an aborted read are still under way."""
    element = rig.device(2)
    rig.ticks(element, Read(), 15, Abort(), 1)
    assert not has_decayed(element)
    return element


def faulty():
    element = rig.set_faults(
        rig.device(1), sensor_noise=2e-6, sensor_dropout=0.02, sensor_lag=25.0,
        actuator_offset=1e-3, actuator_lag=50.0, missed_cycle=0.3,
        weak_cell=40, weak_factor=0.97, damping_factor=1.2, seed=11,
        disorder_alpha=0.002, disorder_k_r=0.002, disorder_s=0.05,
    )  # fmt: skip
    rig.ticks(element, 3)
    element.restart_random_numbers(12)
    rig.ticks(element, SetStrain(0.03), 9)
    return element


@pytest.mark.parametrize(
    'make',
    [rig.device, elastic, written_and_moving, all_active, on_a_trajectory, shaken, pulsed, faulty],
    ids=lambda make: make.__name__,
)
def test_restored_device_has_snapshot_and_goes_on_to_bit(make):
    first = make()
    second = rig.device(design=first.design, calibration=first.calibration)
    second.transducer.fire_probe(End.LEFT)  # what it was doing ends
    second.advance()
    values = rig.save_state(first)
    kept = copy.deepcopy(values)
    snapshot.restore_snapshot(second, values)
    assert rig.save_state(second) == kept
    for name in ('reading', 'calibration', 'faults', 'statistics'):
        assert getattr(second, name) == getattr(first, name)
    for element in (first, second):
        told = rig.ticks(element, 100, SetStrain(0.0), 60) + rig.events(element, Read('both'))
        element.told = [rig.plain(event) for event in told]
    assert first.told == second.told
    assert rig.bits(second) == rig.bits(first)
    assert values == kept, 'a device writes into its snapshot'


NAN, INF = math.nan, math.inf

DAMAGE = [
    ('ticks', -5), ('ticks', INF), ('chain.steps', 7), ('chain.V_N', 1.0), ('chain.V_N', NAN),
    ('chain.values', {}), ('chain.values.f8', ''), ('chain.values.shape', [125, 2]),
    ('chain.values.shape', [6, 113]), ('transducer.recent.shape', [144, 2]),
    ('transducer.recent.shape', [288]), ('actuator', {}), ('actuator.strain', 0.0799),
    ('actuator.motion.target', 0.081), ('actuator.motion.start', -1.0),
    ('actuator.motion.duration', -1.0), ('actuator.motion.duration', INF),
    ('actuator.elapsed', -1.0), ('calibration.left.delays', [1.0, 2.0]),
    ('calibration.left.delays', [float(n % 3) for n in range(4)]),
    ('calibration.right.delays', [1.0]), ('calibration.right.blank', NAN),
    ('calibration.left.shapes', [[1.0, 2.0, 0.0]] * 4),  # an echo of no height
    ('calibration.left.shapes', [[1.0, NAN, 2.0]] * 4),
    ('calibration.left.shapes', [[1.0, 2.0, 3.0]]),
    ('calibration.pulse_corrections', {'steps': [{'peak': NAN}] * 4, 'schedule': ''}),
    ('calibration.pulse_corrections', {'steps': [{'times': 0.0}] * 4, 'schedule': ''}),
    ('calibration.pulse_corrections', {'steps': [{'peak': 1.0}], 'schedule': ''}),
    ('reading.level', 4),
    ('reading.level', -3), ('design.gamma', -1e-4), ('design.N', 124), ('statistics.reads', -1),
    ('statistics.level_writes', [0] * 3), ('transducer.returns', {}),
    ('transducer.returns.left.bound', -1.0), ('transducer.returns.right.since', -1),
    ('sensors.late', ...), ('random_since', 10**9), ('random_since', -1), ('last_moved', 10**9),
    ('faults.weak_cell', 126), ('faults.sensor_noise', -1.0), ('linkage.encoder_strain', NAN),
    ('linkage.commanded', 0.01), ('base.acceleration', INF), ('base.silence', 0.5),
]  # fmt: skip
"""Entries of a snapshot and what they are replaced by; ... takes them out. Values of another type
are tried in `test_outside`.
"""

BAD_MOTIONS = [
    ('times', [0.0]), ('times', [0.0, 2.0, 1.0, 4.0]), ('times', [1.0, 2.0, 3.0, 4.0]),
    ('strains', [0.0, 0.0, 0.0, 0.5]), ('rates', [0.0]), ('rates', [0.0, NAN, 0.0, 0.0]),
]  # fmt: skip
"""Of a trajectory through four points."""


def damaged(values, path, value):
    values = copy.deepcopy(values)
    *above, last = path.split('.')
    place = functools.reduce(dict.get, above, values)
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return values


def test_damaged_snapshot_is_rejected_and_changes_nothing(written):
    element = written_and_moving()
    other, before = written(2), rig.bits(element)
    whole = snapshot.take_snapshot(other)
    nested = functools.reduce(lambda inner, _: [inner], range(900), [])
    wrong = [damaged(whole, path, value) for path, value in DAMAGE]
    wrong += [None, [], 'snapshot', 7, {}, damaged(whole, 'statistics.level_writes', nested)]
    arrays = {'chain.values': other.chain.state(), 'transducer.recent': other.transducer.recent}
    for path, number in [*itertools.product(arrays, (NAN, INF)), ('chain.values', 1e13)]:
        numbers = arrays[path].copy()
        numbers[0, 100] = number  # 1e13 is far beyond any real displacement
        wrong.append(damaged(whole, path, encode_value(numbers)))
    moving = snapshot.take_snapshot(on_a_trajectory())
    wrong += [damaged(moving, f'actuator.motion.{name}', value) for name, value in BAD_MOTIONS]
    for values in wrong:
        with pytest.raises(StateError):
            snapshot.restore_snapshot(element, values)
        assert rig.bits(element) == before
    assert element.actuator.is_moving
