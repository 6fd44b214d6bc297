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


def test_what_fails_names_the_way_home(lost):
    outcome = rig.run(lost, Read())
    assert not outcome.success
    assert outcome.error.endswith('reset replaces the element by a blank one')
    assert 'reset' not in rig.run(rig.device(), Erase()).error


def test_a_reset_element_is_as_new(lost):
    lost.statistics.cycles = 17
    outcome = rig.run(lost, Reset())
    assert outcome.success
    assert outcome.reading.level == BLANK
    assert not lost.actuator.strain
    assert np.allclose(lost.chain.v, lost.design.D_s1, atol=1e-2)  # but for its own probe
    assert (lost.statistics.cycles, lost.statistics.resets) == (17, 1)
    assert rig.succeed(lost, Write(1)).level == 1


def test_a_reset_fails_if_the_new_element_is_not_heard(lost):
    lost.apply(SetFaults(Faults(sensor_dropout=1.0)))
    outcome = rig.run(lost, Reset())
    assert not outcome.success
    assert outcome.error.startswith('the new element is not read as blank: ')


def test_a_reset_is_repeated_to_the_bit(lost):
    twin = rig.device()
    snapshot.restore_snapshot(twin, snapshot.take_snapshot(lost))
    for element in (lost, twin):
        rig.run(element, Reset())
    assert snapshot.hash_state(twin) == snapshot.hash_state(lost)


@pytest.mark.parametrize(('name', 'content'), [('bits_2', 2), ('register_4', 9)])
def test_reset_to_content_reads_it_at_once(name, content):
    element = MemoryElement(mlmem.load_element(name))
    outcome = element.perform(Reset(content))
    assert outcome.success, outcome.error
    assert outcome.reading.content == content
    walls = element.reader.list_walls(content)
    assert len(find_walls(element.design, element.chain.configuration)) == len(walls)


def test_reset_to_content_out_of_range_is_refused_by_name():
    element = MemoryElement(mlmem.load_element('bits_2'))
    with pytest.raises(Refused) as refusal:
        element.perform(Reset(4))
    assert (refusal.value.code, refusal.value.field) == (ErrorCode.OUT_OF_RANGE, 'content')


def test_a_real_element_is_replaced_by_hand():
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


def test_states_of_before_know_no_resets(lost):
    taken = snapshot.take_snapshot(lost)
    del taken['statistics']['resets']
    other = rig.device()
    snapshot.restore_snapshot(other, taken)
    assert other.statistics.resets == 0
