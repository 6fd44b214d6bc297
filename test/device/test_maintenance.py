# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An abort at any moment of any procedure, the self-test, and the reset."""

import dataclasses

import numpy as np
import pytest
import rig
from hypothesis import given, settings
from hypothesis import strategies as st
from lines import LocalDriver

from mlmem import BLANK, Abort, Calibrate, Erase, Outcome, Read, Reset, SelfTest, SetStrain, Write
from mlmem.instrument.end import End
from mlmem.physics import CASE_II, find_walls
from mlmem.procedures import writing
from mlmem_ros.contract.answers import outcome_to_dict

TWO_LEVELS = dataclasses.replace(CASE_II, N=75)
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
    ended = [(outcome.procedure, outcome.success, outcome.error) for outcome in outcomes]
    assert ended == [*([(running, False, 'aborted')] if running else []), ('abort', True, '')]
    assert element.ticks - begun <= 61  # 1200 time units of release
    assert element.actuator.strain == element.chain.V_N == 0.0
    assert not element.actuator.is_moving
    assert not element.transducer.is_driving


@settings(rig.unhurried, max_examples=4)
@given(COMMANDS, st.integers(BLANK, 3), st.floats(0.0, 1.0), st.integers(0, 3))
def test_after_abort_at_any_tick_next_write_succeeds(command, content, moment, level):
    """400 random aborts were tried once; none failed."""
    element = rig.device(content)
    longest = {Write: 700, Erase: 900, Calibrate: 2000}[type(command)]
    rig.ticks(element, command, 1 + round(moment * longest))
    abort(element)
    assert rig.succeed(element, Write(level)).reading.level == level
    assert rig.true_level(element) == level


@pytest.mark.parametrize('moment', [2, 4, 6, 12, 20])
@pytest.mark.parametrize('level', [0, 3])
def test_echo_of_aborted_read_does_not_reach_next(level, moment):
    """The pulses take 8 ticks; their echoes are still on the way when both ends are quiet again.

    The abort itself waits for nothing.
    """
    element = rig.device(level)
    rig.ticks(element, Read(), moment)
    for _ in range(2):
        begun = element.ticks
        abort(element)
        assert element.ticks == begun + 1
        assert not element.transducer.detectors
    for _ in range(2):
        reading = rig.succeed(element, Read()).reading
        assert reading.level == level
        assert reading.level_margin > 0.9


def test_sound_element_passes_and_keeps_its_content(written):
    element = written(2)
    *told, outcome = rig.events(element, SelfTest())
    assert outcome.success, outcome.error
    assert [check.name for check in outcome.checks] == [
        'transducer left', 'transducer right', 'actuator', 'erase',
        *(f'level {level}' for level in range(4)), 'restore',
    ]  # fmt: skip
    assert all(check.passed for check in outcome.checks)
    assert rig.true_level(element) == 2
    assert outcome.reading.level == 2
    heard = [event.reading for event in rig.find_echoes(told)]
    assert {reading.level for reading in heard if reading.walls == 1} == set(range(4))
    for end in End:
        learnt = element.calibration.table(end).delays[3]
        assert outcome.checks[-2].values[f'{end}_delay'] == pytest.approx(learnt, abs=2.6)
    assert outcome_to_dict(outcome)['checks']['level 3'] == 'read'
    assert outcome_to_dict(outcome)['checks']['erase'] == 'blank'


def test_level_that_is_not_reached_is_named_others_are_tested(written):
    """Tension frees the wall at odd levels; without it the wall stays at level 1."""
    element = written(1, write={'tension': 0.02, 'attempts': 1})
    outcome = element.perform(SelfTest())
    assert rig.failed_checks(outcome) == [f'level {level}' for level in (2, 3)]
    assert 'level 2 was not reached in 1 attempts' in outcome.checks[6].message
    assert outcome.checks[-1].passed
    assert rig.true_level(element) == 1


def test_level_that_is_read_as_another_fails(monkeypatch):
    """Although its write has succeeded."""
    write = writing.write
    monkeypatch.setattr(writing, 'write', lambda element, level: write(element, 0))
    outcome = rig.device(0, design=TWO_LEVELS).perform(SelfTest())
    assert rig.failed_checks(outcome) == ['level 1']
    assert outcome.checks[-2].message == 'level 0'


@pytest.mark.parametrize(
    ('wrong', 'felt'),
    [
        (lambda strain: 0.9 * strain, (0.0, 0.009)),
        (lambda strain: strain + 0.001, (0.001, 0.011)),
    ],
    ids=['weak', 'offset'],
)
def test_actuator_that_does_not_follow_is_found(written, wrong, felt):
    """Then nothing is written. At a free end a strain is measured to a hundredth."""
    element = written(3)
    advance, N = element.chain.advance, element.design.N
    element.chain.advance = lambda V_N, *more: advance(wrong(V_N / N) * N, *more)
    rig.ticks(element, 100)
    outcome = element.perform(SelfTest())
    assert rig.failed_checks(outcome) == ['actuator']
    values = outcome.checks[-1].values
    assert (values['offset'], values['felt']) == pytest.approx(felt, abs=2e-4)
    element.chain.advance = advance
    rig.ticks(element, 100)
    assert rig.true_level(element) == 3


@pytest.mark.parametrize('level', [BLANK, 2])
def test_stuck_actuator_is_named_and_left_with_no_set_point(written, level):
    """With a set-point of 0.01 it would move there as soon as it comes loose."""
    element = rig.set_faults(written(level), actuator_stuck=True)
    assert rig.failed_checks(element.perform(SelfTest())) == ['actuator']
    assert element.actuator.motion.target == 0.0
    rig.ticks(element, 100)
    assert element.is_released
    rig.ticks(rig.set_faults(element), 10)
    assert element.chain.V_N == 0.0
    assert rig.true_level(element) == level


def test_failed_erase_fails_levels_and_restoration():
    """A kink that no strain frees stays in the element: nothing can be written or restored."""
    single = dataclasses.replace(CASE_II, N=50)
    feeble = {'compression': -0.001, 'tension': 0.001}
    outcome = rig.device(0, design=single, erase=feeble, write={'attempts': 1}).perform(SelfTest())
    assert rig.failed_checks(outcome) == ['erase', 'level 0', 'restore']
    failed = [check for check in outcome.checks if not check.passed]
    assert all(check.message.startswith('the element is not blank') for check in failed)


def test_reset_element_is_as_new():
    """Every cell rests beyond the active phase: the ground states of psi lie a period apart, at
    D_s2 and as far again. What is not heard is no success.
    """
    lost = rig.device(3)
    design = lost.design
    rig.settle(lost, np.full(design.N, 2.0 * design.D_s2 - design.D_s1))
    rig.ticks(lost, SetStrain(0.001), 20)
    lost.statistics.cycles = 17
    outcome = rig.succeed(lost, Reset())
    assert outcome.reading.level == BLANK
    assert not lost.actuator.strain
    assert np.allclose(lost.chain.v, design.D_s1, atol=1e-2)  # but for its own probe
    assert (lost.statistics.cycles, lost.statistics.resets) == (17, 1)
    assert rig.succeed(lost, Write(1)).reading.level == 1
    rig.set_faults(lost, sensor_dropout=1.0)
    outcome = lost.perform(Reset())
    assert (outcome.success, outcome.code) == (False, 'undecodable')


@pytest.mark.parametrize('content', [BLANK, 0, 2])
def test_reset_gives_the_new_element_its_content(content):
    element = rig.device(1)
    assert element.perform(Reset(content=content)).reading.content == content
    assert len(find_walls(element.design, element.chain.configuration)) == (content >= 0)


def reset_and_read(seed, begun):
    """Return all samples of a reset and a read of a noisy element after so many ticks."""
    element = rig.set_faults(rig.device(2), sensor_noise=1e-5, sensor_delay=3.0, seed=1)
    events = rig.ticks(element, begun)
    for command in (Reset(content=2, seed=seed), Read()):
        events += rig.events(element, command)
    return [event.echo.v_m for event in rig.find_echoes(events)]


def test_reset_with_a_seed_repeats_the_noisy_samples():
    first, again = reset_and_read(7, begun=3), reset_and_read(7, begun=16)
    other = reset_and_read(8, begun=3)
    assert len(first) == len(again) == len(other) >= 4
    assert all(map(np.array_equal, first, again))
    assert not any(map(np.array_equal, first, other))


def test_maintenance_that_sees_only_the_ends_gives_the_same_bits():
    """None can reach the true wall: a local driver shows only the ends. Such an element is
    replaced by hand. That of other procedures is in `test_rig`.
    """
    seeing = rig.device(design=TWO_LEVELS)
    blind = rig.device(design=TWO_LEVELS, driver=LocalDriver(TWO_LEVELS))
    for command in (Calibrate(), SelfTest()):
        told = [rig.plain(each.perform(command)) for each in (seeing, blind)]
        assert told[0] == told[1]
    for element in (seeing, blind):
        element.apply(SetStrain(0.01))
        element.apply(Write(0))
        element.perform(Abort())
    assert blind.transducer.recent.tobytes() == seeing.transducer.recent.tobytes()
    assert blind.calibration == seeing.calibration
    outcome = blind.perform(Reset())
    assert not outcome.success
    assert 'a real element has to be replaced by hand' in outcome.error
