# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A reset brings an element home whose cells have left their two phases."""

import numpy as np
import pytest

import mlmem
from mlmem import (
    BLANK,
    Erase,
    Faults,
    MemoryElement,
    Read,
    Refused,
    Reset,
    SetFaults,
    SetStrain,
    Write,
    snapshot,
)
from mlmem.physics import find_walls
from mlmem.rejections import ErrorCode

from . import rig
from .test_blindfold import blindfolded


@pytest.fixture
def lost():
    """Return an element of which every cell rests beyond the active phase, and which is strained.

    The ground states of psi lie a period apart: D_s2 and as far again.
    """
    element = rig.device(3)
    design = element.design
    beyond = 2.0 * design.D_s2 - design.D_s1
    element.chain.place(np.full(design.N, beyond))
    element.transducer.assume_equilibrium()
    element.apply(SetStrain(0.001))
    rig.ticks(element, 20)
    return element


def test_what_fails_names_way_home(lost):
    outcome = rig.run(lost, Read())
    assert not outcome.success
    assert outcome.error.endswith('reset replaces the element by a blank one')
    assert 'reset' not in rig.run(rig.device(), Erase()).error


def test_reset_element_is_as_new(lost):
    lost.statistics.cycles = 17
    outcome = rig.run(lost, Reset())
    assert outcome.success
    assert outcome.reading.level == BLANK
    assert not lost.actuator.strain
    assert np.allclose(lost.chain.v, lost.design.D_s1, atol=1e-2)  # but for its own probe
    assert (lost.statistics.cycles, lost.statistics.resets) == (17, 1)
    assert rig.succeed(lost, Write(1)).level == 1


def test_reset_fails_if_new_element_is_not_heard(lost):
    lost.apply(SetFaults(Faults(sensor_dropout=1.0)))
    outcome = rig.run(lost, Reset())
    assert not outcome.success
    assert outcome.error.startswith('the new element is not read as blank: ')


def test_reset_is_repeated_to_bit(lost):
    twin = rig.device()
    snapshot.restore_snapshot(twin, snapshot.take_snapshot(lost))
    for element in (lost, twin):
        rig.run(element, Reset())
    assert snapshot.hash_state(twin) == snapshot.hash_state(lost)


def test_real_element_is_replaced_by_hand():
    element, _ = blindfolded(3)
    outcome = rig.run(element, Reset())
    assert not outcome.success
    assert 'a real element has to be replaced by hand' in outcome.error


def test_faults_stay(lost):
    """The actuator is as stuck as before, and the new specimen has the weak cell."""
    faults = Faults(weak_cell=5, actuator_stuck=True)
    lost.apply(SetFaults(faults))
    assert rig.run(lost, Reset()).success
    assert lost.faults == faults
