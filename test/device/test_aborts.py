# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An abort, at any moment of any procedure."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem import Abort, Calibrate, Erase, Outcome, Read, SetStrain, Write
from mlmem.settings import ReadSettings

from . import rig

COMMANDS = st.one_of(st.builds(Write, st.integers(0, 3)), st.just(Erase()), st.just(Calibrate()))


def abort(element):
    """Abort, and check the conditions at once and after the abort has ended."""
    running = element.procedure
    begun = element.ticks
    element.apply(Abort())
    told = element.advance()
    assert not element.transducer.is_driving, 'a held cell is let go at once'
    while element.procedure:
        told += element.advance()
    outcomes = [event for event in told if isinstance(event, Outcome)]
    if running:
        assert (outcomes[0].procedure, outcomes[0].error) == (running, 'aborted')
        assert not outcomes[0].success
    assert outcomes[-1].procedure == 'abort'
    assert outcomes[-1].success
    assert element.ticks - begun <= 61  # 1200 time units of release
    assert element.actuator.strain == element.chain.V_N == 0.0
    assert not element.actuator.is_moving
    assert not element.transducer.is_driving
    assert element.procedure == ''


@settings(rig.unhurried, max_examples=4)
@given(COMMANDS, st.none() | st.integers(0, 3), st.floats(0.0, 1.0), st.integers(0, 3))
def test_after_abort_at_any_tick_next_write_succeeds(command, content, moment, level):
    """400 random aborts were tried once; none failed."""
    element = rig.device(content)
    longest = {Write: 700, Erase: 900, Calibrate: 2000}[type(command)]
    element.apply(command)
    rig.ticks(element, 1 + round(moment * longest))
    abort(element)
    assert rig.succeed(element, Write(level)).level == level
    assert rig.holds(element, level)


@pytest.mark.parametrize(('content', 'command'), [(None, Write(0)), (0, Erase())], ids=str)
def test_abort_while_wall_is_launched(content, command):
    """The boundary cell moves for 40 time units, so for 2 or 3 ticks; then the wall runs."""
    element = rig.device(content)
    element.apply(command)
    while not (element.transducer.is_driving and not element.transducer.detectors):
        element.advance()
    launched = element.ticks
    caught = []
    for tick in range(launched - 1, launched + 4):
        element = rig.device(content)
        element.apply(command)
        rig.ticks(element, tick)
        caught.append(element.transducer.is_driving)
        abort(element)
        assert rig.succeed(element, Write(1)).level == 1
        assert rig.holds(element, 1)
    assert caught[1]
    assert not caught[0]
    assert not caught[-1]


def test_abort_reports_its_reason(written):
    element = written(1)
    element.apply(Write(3))
    rig.ticks(element, 5)
    told = rig.events(element, Abort('the door is open'))
    assert [outcome.error for outcome in told] == ['aborted: the door is open', '']


def test_abort_releases_strain_set_by_hand(written):
    element = written(2, read=ReadSettings(min_margin=0.2))
    element.apply(SetStrain(0.03))
    rig.ticks(element, 100)
    rig.succeed(element, Read())
    abort(element)
    assert element.reading is None, 'the wall may have moved with the strain'


def test_abort_of_nothing_keeps_reading(written):
    element = written(2)
    known = element.reading
    begun = element.ticks
    abort(element)
    assert element.reading is known
    assert element.ticks == begun + 1


@pytest.mark.parametrize('moment', [2, 4, 6, 12, 20])
@pytest.mark.parametrize('level', [0, 3])
def test_echo_of_aborted_read_does_not_reach_next(level, moment):
    """The pulses take 8 ticks; their echoes are still on the way when both ends are quiet again.

    The abort itself waits for nothing.
    """
    element = rig.device(level)
    element.apply(Read())
    rig.ticks(element, moment)
    for _ in range(2):
        begun = element.ticks
        abort(element)
        assert element.ticks == begun + 1
        assert not element.transducer.detectors
    for _ in range(2):
        reading = rig.succeed(element, Read())
        assert reading.level == level
        assert reading.level_margin > 0.9


@pytest.mark.parametrize(
    ('first', 'ticks'), [(Write(3), 0), (SetStrain(0.03), 0), (Abort(), 10)], ids=str
)
def test_abort_in_tick_of_command_or_of_abort(written, first, ticks):
    element = written(1)
    if first == Abort():  # of a write
        element.apply(Write(3))
        rig.ticks(element, 60)
    element.apply(first)
    rig.ticks(element, ticks)
    abort(element)
    assert rig.ticks(element, 20) == []
