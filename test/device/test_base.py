# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A base that shakes: its motion, its time-out, and its effect on chain and content."""

import dataclasses
import math

import numpy as np
import pytest

from mlmem import Disturb, MemoryElement, Refused, Settings, factory_calibration
from mlmem.instrument.base import Base, BaseState
from mlmem.physics import CASE_II, find_level
from mlmem.settings import DisturbanceSettings, ScaleSettings

from . import rig

TICK = 20.0
PROGRESS = np.array([0.25, 0.5, 0.75, 1.0])


def test_acceleration_ramps_linearly_to_message_and_holds():
    base = Base(DisturbanceSettings(), TICK)
    assert base.advance(PROGRESS) is None
    assert not base.find_harmful_tick()
    base.disturb(4e-3)
    np.testing.assert_allclose(base.advance(PROGRESS), [1e-3, 2e-3, 3e-3, 4e-3], rtol=1e-15)
    np.testing.assert_array_equal(base.advance(PROGRESS), [4e-3] * 4)
    base.disturb(-4e-3)
    np.testing.assert_allclose(base.advance(PROGRESS), [2e-3, 0.0, -2e-3, -4e-3], atol=1e-18)


def test_dead_sensor_stops_shaking_base():
    """A time-out of 60 is three ticks: held for these, and back at rest after a fourth."""
    base = Base(DisturbanceSettings(timeout=60.0), TICK)
    base.disturb(1e-3)
    ends = []
    while (course := base.advance(PROGRESS)) is not None:
        ends.append(course[-1])
    assert ends == [1e-3, 1e-3, 1e-3, 0.0]
    assert base.state == BaseState()  # as if it had never moved
    base.disturb(1e-3)  # and again
    assert base.advance(PROGRESS)[-1] == 1e-3


def test_scale_gives_unit_of_acceleration():
    """One lattice constant of 1 cm per (0.1 ms)^2 is a million m/s^2."""
    assert ScaleSettings().acceleration == pytest.approx(1e6)
    assert ScaleSettings(time=1e-2, length=1e-2).acceleration == pytest.approx(100.0)


def test_constant_acceleration_displaces_every_cell_alike():
    """In the frame of the base every cell gives way by -a / k_s1, and lets go of it again.

    Without gradient and defects that is exact to first order; the next is a / k_s1 times as
    small, 1e-3. Waves of the start lose exp(-eta t / 2): 1e-4 is left after 4600 time units.
    """
    design = dataclasses.replace(CASE_II, gamma=0.0, beta=0.0)
    calibration = factory_calibration(CASE_II, Settings())  # this one has no levels to learn
    element = rig.device(design=design, calibration=calibration, disturbance={'timeout': 1e5})
    a = 2e-4
    element.apply(Disturb(a))
    rig.ticks(element, 230)
    np.testing.assert_allclose(element.chain.v - design.D_s1, -a / design.k_s1, rtol=2e-3)
    element.apply(Disturb(0.0))
    rig.ticks(element, 230)
    np.testing.assert_allclose(element.chain.v, design.D_s1, atol=1e-6)


def shaken(element, omega, amplitude):
    """Shake a device tick by tick as the map of retention shakes a chain, and let it rest."""
    for tick in range(125):  # 2500 time units
        t = (tick + 1) * TICK
        x = min(t / 500.0, (2500.0 - t) / 500.0, 1.0)  # rises and falls
        element.apply(Disturb(amplitude * x * x * (3.0 - 2.0 * x) * math.sin(omega * t)))
        element.advance()
    element.apply(Disturb(0.0))
    rig.ticks(element, 75)


LEVELS = (0, 3)


def kept(omega, amplitude):
    """Return how many levels survive a shake."""
    count = 0
    for level in LEVELS:
        element = rig.device(level)
        shaken(element, omega, amplitude)
        count += find_level(element.design, element.chain.configuration) == level
    return count


def test_slow_shake_beyond_hold_of_defect_loses_level():
    """At 8.1e-4 to 9.6e-4 the landscape's steepest slope is outweighed; see the study."""
    assert kept(0.01, 7e-4) == len(LEVELS)
    assert kept(0.01, 1.2e-3) < len(LEVELS)


def test_acceleration_that_makes_all_cells_slide_is_rejected():
    """However much is to be taken: beyond the force that holds the cells nothing stops them."""
    design = dataclasses.replace(CASE_II, d=0.002)
    element = MemoryElement(design, Settings(), factory_calibration(CASE_II, Settings()))
    hold = design.holding_force
    assert hold == pytest.approx(CASE_II.holding_force * 0.002 / 0.038)
    assert hold < Settings().disturbance.max_acceleration < CASE_II.holding_force
    with pytest.raises(Refused, match=r'acceleration must be .* no cell of this design stays'):
        element.apply(Disturb(1.01 * hold))
    element.apply(Disturb(0.5 * hold))  # met within a tick: the cells swing about where they rest
    rig.ticks(element, 100)
    assert find_level(design, element.chain.configuration) == -1
