# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The device between its ticks: what it accepts, what it refuses, and that bits repeat."""

import dataclasses
import math
import re

import pytest

from mlmem import (
    Abort,
    Calibrate,
    Calibration,
    DelayTable,
    Disturb,
    EchoReceived,
    Erase,
    Faults,
    FollowTrajectory,
    MemoryElement,
    Outcome,
    Read,
    Refused,
    SetFaults,
    SetStrain,
    Settings,
    SettingsError,
    Unknown,
    Write,
)
from mlmem.physics import CASE_II, PEFRL, Specimen, stable_step
from mlmem.rejections import ErrorCode
from mlmem.settings import TimeSettings

from . import rig


@pytest.mark.parametrize('tick', [20.0, 0.1, 7.3, 333.0])
@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
def test_tick_is_whole_number_of_stable_steps(tick, substrate):
    design = dataclasses.replace(rig.DESIGN, substrate=substrate)
    element = rig.device(
        design=design, calibration=rig.device().calibration, time=TimeSettings(tick=tick)
    )
    steps, dt = element.steps_per_tick, element.chain.dt
    assert steps * dt == pytest.approx(tick, rel=1e-14)
    largest = min(PEFRL.accurate_step, stable_step(Specimen(design), PEFRL))
    assert dt <= largest
    assert steps == 1 or tick / (steps - 1) > largest, 'fewer steps would do'
    element.advance()
    assert (element.ticks, element.chain.steps_done) == (1, steps)
    assert element.chain.time == pytest.approx(tick)


def test_tick_of_too_many_steps_is_rejected():
    """It would block everything, including a stop; the message says what tick is possible."""
    long = dataclasses.replace(rig.DESIGN, substrate='elastic', s_min=1e6, s_max=1e8)
    with pytest.raises(SettingsError, match=r'time.tick must be at most (\S+), which') as refusal:
        MemoryElement(long, Settings(time=TimeSettings(tick=1e4)), rig.device().calibration)
    most = float(re.search(r'most (\S+),', str(refusal.value))[1])
    element = MemoryElement(
        long, Settings(time=TimeSettings(tick=0.99 * most)), rig.device().calibration
    )
    assert element.steps_per_tick * 1000 <= 10**8


def test_calibration_of_another_element_is_rejected():
    three = DelayTable((1.0, 2.0, 3.0))
    with pytest.raises(SettingsError, match='must have 8 levels, like the design; got 3'):
        MemoryElement(CASE_II, Settings(), Calibration(three, three))


BAD = [
    SetStrain(math.nan), SetStrain(math.inf), SetStrain(-0.081), SetStrain('0.01'),
    Write(4), Write(-1), Write(1.0), Write(True), Write('3'), Write(None), Write(math.nan),
    Read('top'), Read(None), Read(['left']),
    'write', None, {'kind': 'Write', 'level': 1},
]  # fmt: skip


def test_bad_command_is_rejected_and_changes_nothing(written):
    element = written(2)
    element.apply(SetStrain(0.01))
    rig.ticks(element, 2)
    before = rig.bits(element)
    for command in BAD:
        with pytest.raises(Refused) as rejected:
            element.apply(command)
        assert rejected.value.code is ErrorCode.OUT_OF_RANGE
        assert rig.bits(element) == before, command


@pytest.mark.parametrize('running', [Write(3), Erase(), Read(), Calibrate(), Abort()], ids=str)
def test_busy_device_refuses_commands_and_goes_on_unchanged(written, running):
    disturbed, alone = written(2), written(2)
    for element in (disturbed, alone):
        if running == Abort():  # one that has something to do
            element.apply(SetStrain(0.01))
            rig.ticks(element, 10)
        element.apply(running)
        rig.ticks(element, 7)
    before = rig.bits(disturbed)
    trajectory = FollowTrajectory((0.1,), (0.01,))
    for command in (SetStrain(0.0), trajectory, Write(1), Read(), Erase(), Calibrate()):
        with pytest.raises(Refused) as rejected:
            disturbed.apply(command)
        assert rejected.value.code is ErrorCode.BUSY
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
    element.apply(SetStrain(0.001))
    assert element.reading is None
    assert element.advance() == [Unknown('strained by hand', since)]
    element.apply(SetStrain(0.002))
    assert element.advance() == [], 'it is reported once'
    assert str(element.unknown) == f'unknown since tick {since}: strained by hand'


def test_command_that_may_move_wall_makes_unknown(written):
    """And what cannot move it is not: a fault of a sensor, a shake that is weak, an idle abort."""
    harmless = written(3)
    for command in (SetFaults(Faults(sensor_noise=1e-6)), Disturb(1e-6), Abort()):
        harmless.apply(command)
        assert not any(isinstance(event, Unknown) for event in rig.ticks(harmless, 5))
        assert harmless.reading.level == 3
    for command, reason in (
        (SetFaults(Faults(weak_cell=3)), 'faults were set'),
        (Disturb(2e-4), 'shaken'),
    ):
        element = written(3)
        element.apply(command)
        assert element.advance(9) == [Unknown(reason, element.unknown.since)]
    held = written(3)
    held.apply(SetStrain(0.001))
    rig.ticks(held, 300)
    assert rig.succeed(held, Read()).level == 3
    held.apply(Abort())
    assert held.unknown.reason == 'aborted'
    moved = written(3)
    moved.apply(Write(1))
    while moved.reading is not None:
        moved.advance()
    moved.apply(Abort())
    assert moved.unknown.reason == 'aborted'


@pytest.mark.parametrize(('command', 'level'), [(Write(3), 3), (Write(0), 0), (Erase(), -1)])
def test_content_is_unknown_while_wall_moves(written, command, level):
    element = written(1)
    element.apply(command)
    while element.procedure:
        strained = element.actuator.strain != 0.0
        assert not strained or element.reading is None
        element.advance()
    assert element.reading.level == level


def test_released_device_runs_nothing_and_has_no_strain(written):
    element = written(2)
    assert element.is_released
    element.apply(SetStrain(0.004))  # two ticks
    assert not element.is_released
    rig.ticks(element, 3)
    assert not element.actuator.is_moving
    assert not element.is_released
    element.apply(SetStrain(0.0))
    rig.ticks(element, 3)
    assert element.is_released
    element.apply(Read())
    assert not element.is_released
    rig.ticks(element, 300)
    assert element.is_released


def test_read_reports_echo_and_then_outcome():
    element = rig.device(2)
    rig.ticks(element, 3)
    other, heard, outcome = rig.events(element, Read())
    assert isinstance(heard, EchoReceived)
    assert other.echo.end == 'right'  # the end that is reported comes last
    assert other.reading == heard.reading == outcome.reading == element.reading
    assert heard.echo.end == 'left'
    assert heard.echo.delay == heard.reading.delay
    assert isinstance(outcome, Outcome)
    assert (outcome.procedure, outcome.success, outcome.error) == ('read', True, '')
    assert outcome.start_tick == 3
    # it ended in the last tick, whose number is one below the count of ticks
    assert outcome.end_tick == element.ticks - 1


def test_listening_ends_after_echo_or_when_none_can_come():
    """150 time units after the last crossing; or after a tenth more than the longest echo."""
    element = rig.device(0)
    *echoes, _ = rig.events(element, Read())
    right = next(each.echo for each in echoes if each.echo.end == 'right')  # level 0 is far
    assert right.t[-1] == pytest.approx(right.delay + 150.0, abs=20.0)
    deaf = rig.device(0, **rig.with_group('probe', v_th=0.9))
    *echoes, outcome = rig.events(deaf, Read())
    assert outcome.error == 'no echo came back'
    left = next(each.echo for each in echoes if each.echo.end == 'left')
    longest = 1.1 * deaf.calibration.longest(left.end)
    assert left.t[-1] == pytest.approx(longest + 150.0, abs=25.0)
