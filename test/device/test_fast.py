# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The fast schedule writes every level, upward, in one go, and downward."""

import dataclasses

import numpy as np
import pytest

from mlmem_ros.device import Abort, Read, SetStrain, Write, new_element
from mlmem_ros.parameter_file import load
from mlmem_ros.physics import CASE_II, Specimen
from mlmem_ros.physics.equilibrium import resting_wall

from .rig import holds, run, succeed, wall

_, FAST = load('fast')
PER_LEVEL = 1800.0


@pytest.fixture(scope='module')
def element():
    return new_element(CASE_II, FAST)


def test_every_level_is_written_upward_and_downward(element):
    for level in (*range(CASE_II.levels), 2):
        assert succeed(element, Write(level)).level == level
        assert holds(element, level)


def test_a_wall_stuck_between_two_levels_is_detected():
    """The lattice can hold it some nine cells before a defect; its echo shows that."""
    element = new_element(CASE_II, FAST)
    v = np.roll(resting_wall(Specimen(CASE_II), 1), 16)
    v[:16] = CASE_II.D_s2
    element.chain.place(v)
    element.chain.rest(20_000)
    element.transducer.assume_rest()
    assert wall(element) == pytest.approx(65.95, abs=0.05)
    outcome = run(element, Read())
    assert not outcome.success
    assert 'margin' in outcome.error
    assert succeed(element, Write(3)).level == 3  # it is erased and written anew
    assert holds(element, 3)


@pytest.mark.parametrize('level', [5, 7])
def test_several_levels_are_written_in_one_go(element, level):
    """From level 2, and on from 5, without a long rest on the way."""
    outcome = run(element, Write(level))
    assert outcome.success
    assert outcome.attempts == 1
    assert holds(element, level)


def test_a_cycle_pauses_on_the_way_back_and_takes_the_stated_time():
    settings = dataclasses.replace(FAST, write=dataclasses.replace(FAST.write, final_settle=0.0))
    element = new_element(CASE_II, settings)
    succeed(element, Write(0))
    element.apply(Write(1))
    strain = []
    for _ in range(round(PER_LEVEL / element.tick)):
        element.advance()
        strain.append(element.actuator.strain)
    write = FAST.write
    at = np.cumsum([write.ramp, write.hold, write.ease, write.release]) / element.tick - 1
    seen = np.array(strain)[at.astype(int)] / write.compression
    np.testing.assert_allclose(seen, [1.0, 1.0, write.ease_to, 0.0], atol=1e-12)
    assert np.all(np.array(strain)[int(at[-1]) :] == 0.0)
    assert element.procedure == 'write'  # which ends with a read


def test_an_abort_releases_the_strain_as_slowly_as_an_erase():
    """The way back of a fast write takes a tick, which would be a jerk from the peak."""
    design, settings = load('bits_2')
    assert settings.write.release == settings.time.tick
    element = new_element(design, settings)
    element.apply(SetStrain(0.02))
    while element.actuator.moving:
        element.advance()
    outcome = run(element, Abort())
    assert (outcome.end_tick - outcome.start_tick) * element.tick >= settings.erase.release
