# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The self-test tests every part, names what fails, and keeps the content."""

import dataclasses

import numpy as np
import pytest

from mlmem import (
    DelayTable,
    EchoReceived,
    SelfTest,
)
from mlmem.commands import SetFaults
from mlmem.instrument.end import End
from mlmem.instrument.faults import NO_FAULTS, Faults
from mlmem.move_settings import WriteSettings
from mlmem.physics import CASE_II
from mlmem_ros.contract.answers import outcome_to_dict

from . import rig

NAMES = [
    'transducer left', 'transducer right', 'actuator', 'erase',
    *(f'level {level}' for level in range(4)), 'restore',
]  # fmt: skip


@pytest.mark.parametrize('level', [None, 2])
def test_sound_element_passes_and_keeps_its_content(written, level):
    element = rig.device() if level is None else written(level)
    told = rig.events(element, SelfTest())
    outcome = told[-1]
    assert outcome.success, outcome.error
    assert [check.name for check in outcome.checks] == NAMES
    assert all(check.passed for check in outcome.checks)
    assert rig.holds(element, level)
    assert outcome.reading.level == (-1 if level is None else level)
    heard = [event.reading for event in told if isinstance(event, EchoReceived)]
    assert {reading.level for reading in heard if reading.walls == 1} == set(range(4))
    for end in End:
        learnt = element.calibration.table(end).delays[3]
        assert outcome.checks[-2].values[f'{end}_delay'] == pytest.approx(learnt, abs=2.6)
    assert outcome_to_dict(outcome)['checks']['level 3'] == 'read'
    assert outcome_to_dict(outcome)['checks']['erase'] == 'blank'


def test_level_that_is_not_reached_is_named_others_are_tested(written):
    """Tension frees the wall at odd levels; without it the wall stays at level 1."""
    weak = WriteSettings(tension=0.02, attempts=1)
    element = written(1, write=weak)
    outcome = rig.run(element, SelfTest())
    failed = [check.name for check in outcome.checks if not check.passed]
    assert failed == [f'level {level}' for level in (2, 3)]
    assert outcome.error == f'failed: {", ".join(failed)}'
    assert 'level 2 was not reached in 1 attempts' in outcome.checks[6].message
    assert outcome.checks[-1].passed
    assert rig.holds(element, 1)


@pytest.mark.parametrize(
    ('wrong', 'felt'),
    [
        (lambda strain: 0.0 * strain, (0.0, 0.0)),
        (lambda strain: 0.9 * strain, (0.0, 0.009)),
        (lambda strain: strain + 0.001, (0.001, 0.011)),
    ],
    ids=['stuck', 'weak', 'offset'],
)
def test_actuator_that_does_not_follow_is_found(written, wrong, felt):
    """Then nothing is written. At a free end a strain is measured to a hundredth."""
    element = written(3)
    advance, N = element.chain.advance, element.design.N
    element.chain.advance = lambda V_N, *more: advance(wrong(V_N / N) * N, *more)
    rig.ticks(element, 100)
    outcome = rig.run(element, SelfTest())
    assert outcome.error == 'failed: actuator'
    values = outcome.checks[-1].values
    assert (values['offset'], values['felt']) == pytest.approx(felt, abs=2e-4)
    element.chain.advance = advance
    rig.ticks(element, 100)
    assert rig.holds(element, 3)


@pytest.mark.parametrize('level', [None, 2])
def test_stuck_actuator_is_named_and_left_with_no_set_point(written, level):
    """With a set-point of 0.01 it would move there as soon as it comes loose."""
    element = rig.device() if level is None else written(level)
    element.apply(SetFaults(Faults(actuator_stuck=True)))
    assert rig.run(element, SelfTest()).error == 'failed: actuator'
    assert element.actuator.motion.target == 0.0
    rig.ticks(element, 100)
    assert element.is_released
    element.apply(SetFaults(NO_FAULTS))
    rig.ticks(element, 10)
    assert element.chain.V_N == 0.0
    assert rig.holds(element, level)


def test_content_that_cannot_be_read_is_not_put_at_risk(written):
    """The table of another element does not give the place of the wall."""
    element = written(3)
    foreign = DelayTable(tuple(100.0 + 800.0 * level for level in range(4)))
    element.calibration = dataclasses.replace(element.calibration, left=foreign)
    outcome = rig.run(element, SelfTest())
    assert outcome.error.startswith('not tested: the content cannot be read now')
    assert outcome.checks == ()
    assert rig.holds(element, 3)


def test_failed_erase_fails_levels_and_restoration():
    """A kink that no strain frees stays in the element: nothing can be written or restored."""
    single = dataclasses.replace(CASE_II, N=50)
    feeble = rig.with_group('erase', compression=-0.001, tension=0.001)
    once = rig.with_group('write', attempts=1)
    outcome = rig.run(rig.device(0, design=single, **feeble, **once), SelfTest())
    assert outcome.error == 'failed: erase, level 0, restore'
    failed = [check for check in outcome.checks if not check.passed]
    assert all(check.message.startswith('the element is not blank') for check in failed)


def test_element_that_begins_to_shake_is_not_written(written):
    """Its content was read before; then it waits 6000 time units for quiet at each end."""
    element = written(3)
    element.apply(SelfTest())
    while not any(isinstance(event, EchoReceived) for event in element.advance()):
        pass
    chance = np.random.default_rng(1)
    told = []
    while element.procedure:
        element.chain.velocity[:] += chance.normal(0.0, 1e-3, element.design.N)
        told += element.advance()
    outcome = told[-1]
    assert outcome.error == 'failed: transducer left, transducer right'
    assert all('the element does not come to rest' in check.message for check in outcome.checks)
    assert rig.holds(element, 3)
