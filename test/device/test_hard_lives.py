# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hard lives: any legal design and settings, any commands; the state stays finite throughout."""

import json
import random
import warnings

import numpy as np
import pytest

from mlmem import Outcome, Read, SetStrain, Write, snapshot
from mlmem.physics import StateError
from mlmem.physics.energy import energy
from mlmem.settings import ActuatorSettings

from . import lives, rig

TICKS, MOST_WORK = 40, 1_000_000
"""Bounds of a life: ticks, and steps times cells."""


def live(seed):
    """Live a life; return whether it ended with a lost tick, or None for a refused device."""
    chance = random.Random(seed)
    element = lives.device(chance)
    if element is None:
        return None
    work = element.steps_per_tick * element.design.N
    for _ in range(min(TICKS, MOST_WORK // work)):
        if chance.random() < 0.3:
            lives.give(chance, element)
        before = element.ticks, element.chain.state().tobytes()
        try:
            element.advance()
        except StateError:
            assert (element.ticks, element.chain.state().tobytes()) == before
            assert not element.procedure
            assert element.still
            assert_sound(element)
            return True
    assert_sound(element)
    return False


def assert_sound(element):
    """Assert that all numbers are finite, and that an idle device survives a snapshot."""
    assert np.isfinite(element.chain.state()).all()
    assert np.isfinite(element.transducer.recent).all()
    assert np.isfinite(energy(element.chain).total)
    if not element.procedure:
        taken = snapshot.take_snapshot(element)
        snapshot.restore_snapshot(element, json.loads(json.dumps(taken, allow_nan=False)))


def lost(seeds):
    """Return the seeds of lives that ended with a lost tick; warnings and other errors raise."""
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        return {seed for seed in seeds if live(seed)}


def test_hard_lives_leave_sound_device():
    assert len(lost(range(5, 12))) < 2


@pytest.mark.slow
def test_many_hard_lives_leave_sound_device():
    assert len(lost(range(10_040))) < 300


HASTY = ActuatorSettings(max_strain=0.5, max_rate=1.0)
"""In a tick it strains an element by more than its cells can follow."""


def test_device_can_be_saved_and_goes_on_after_lost_tick():
    element, other = rig.device(3, actuator=HASTY), rig.device(actuator=HASTY)
    rig.ticks(element, 5)
    element.apply(SetStrain(0.5))
    with pytest.raises(StateError, match=r'left the range|stopped being finite'):
        rig.ticks(element, 5)
    assert element.still
    assert rig.holds(element, 3)
    snapshot.restore_snapshot(other, snapshot.take_snapshot(element))
    for each in (element, other):
        rig.ticks(each, 20)
    assert rig.bits(other)[0] == rig.bits(element)[0]
    rig.succeed(element, Read('both'))


def test_lost_tick_ends_procedure_with_outcome(written, monkeypatch):
    element = written(1)
    element.apply(Write(3))
    rig.ticks(element, 20)

    def lose(*inputs):
        raise StateError('a cell left')

    monkeypatch.setattr(element.chain, 'advance', lose)
    with pytest.raises(StateError):
        element.advance()
    monkeypatch.undo()
    (outcome,) = element.advance()
    assert isinstance(outcome, Outcome)
    assert (outcome.procedure, outcome.success, outcome.error) == ('write', False, 'a cell left')
    assert element.reading is None
