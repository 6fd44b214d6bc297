# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the wall is, as the device measures it and as it is: at levels and between them."""

import numpy as np
import pytest

from mlmem import (
    BLANK,
    Disturb,
    Faults,
    Locate,
    Read,
    factory_calibration,
    new_element,
    preset,
)
from mlmem.physics import CASE_II, Specimen, find_walls
from mlmem.physics.equilibrium import relax_to_equilibrium
from mlmem.readers.register import pin_walls

from . import rig

MOST = 3.0
"""Standard deviations by which a measured position may be off."""


def with_walls(*positions, design=CASE_II, first_active=True, **options):
    """Return a device at rest whose phase changes near these positions."""
    step = design.D_s2 - design.D_s1
    v = np.full(design.N, design.D_s2 if first_active else design.D_s1)
    for count, position in enumerate(positions):
        down = (count % 2 == 0) == first_active
        rise = 0.5 * (1.0 + np.tanh((design.sites - position - 0.3) / 3.0))
        v += (-step if down else step) * rise
    element = rig.device(design=design, **options)
    element.chain.place(relax_to_equilibrium(Specimen(design), v, np.zeros(design.N)))
    element.transducer.assume_equilibrium()
    return element


def located(element):
    """Locate the wall, which must succeed, and return what was found."""
    outcome = rig.run(element, Locate())
    assert outcome.success, outcome.error
    return outcome.found


def first(element):
    return find_walls(element.design, element.chain.configuration)[0].position


@pytest.mark.parametrize(
    ('name', 'near'),
    [
        *(('case_2', near) for near in (25, 60, 65, 80, 90, 110, 200)),  # levels are 25 apart
        ('bits_1', 14),  # nothing is known between its two levels
        ('case_1', 81),  # its only level is located by the group velocity
        ('bits_4', 100),  # the right end names the level, and a cell is three time units
    ],
)
def test_wall_is_located_at_levels_and_between_them(name, near):
    design, settings = preset(name)
    known = factory_calibration(design, settings)
    element = with_walls(near, design=design, calibration=known, **settings.groups())
    found = located(element)
    assert found['walls'] == 1
    assert name != 'case_2' or found['position_std'] < 0.5
    assert found['position'] == pytest.approx(first(element), abs=MOST * found['position_std'])


def test_blank_element_has_no_wall_and_no_position():
    element = rig.device()
    assert located(element) == {'walls': 0}
    assert element.reading.level == BLANK


@pytest.mark.parametrize(
    ('positions', 'first_active'), [((50, 100, 175), True), ((50, 100), False), ((), True)]
)
def test_walls_other_than_one_are_not_located(positions, first_active):
    """An end that answers late, or a bad cell, sounds like more walls; () is all active."""
    outcome = rig.run(with_walls(*positions, first_active=first_active), Locate())
    assert (outcome.success, outcome.found) == (False, {})
    assert outcome.error


@pytest.mark.parametrize(
    ('name', 'level', 'end', 'delay'),
    [
        ('kick_4', BLANK, 'both', 15.8),
        ('case_2', 3, 'left', 25.0),
        ('case_2', 3, 'both', 25.0),
        ('bits_4', BLANK, 'right', 25.0),
        ('bits_4', 6, 'left', 15.8),
        ('kick_2', 3, 'left', 20.0),
    ],
)
def test_late_sensors_locate_no_wall_that_is_not_there(name, level, end, delay):
    element = at_level(name, level, Faults(sensor_delay=delay, sensor_end=end))
    outcome = rig.run(element, Locate())
    assert (outcome.success, outcome.found) == (False, {})
    assert outcome.error


@pytest.mark.parametrize(('name', 'level'), [('kick_2', 1), ('kick_2', 3), ('kick_4', 6)])
@pytest.mark.parametrize('delay', [0.0, 2.0, 5.0, 12.0, 20.0])
def test_one_late_sensor_is_rejected_or_within_error(name, level, delay):
    element = at_level(name, level, Faults(sensor_delay=delay, sensor_end='right'))
    outcome = rig.run(element, Locate())
    if delay == 0.0:
        assert outcome.success
    if outcome.success:
        found = outcome.found
        assert found['walls'] == 1
        assert abs(found['position'] - first(element)) <= MOST * found['position_std']


def at_level(name, level, faults):
    """Return a shipped element at rest at a level, with faults."""
    element = new_element(preset(name))
    element.chain.place(pin_walls(Specimen(element.design), () if level == BLANK else (level,)))
    element.set_faults(faults)
    element.transducer.assume_equilibrium()
    return element


def test_shaken_wall_is_not_located(written):
    element = written(3)
    element.apply(Disturb(1e-4))
    outcome = rig.run(element, Locate())
    assert not outcome.success
    assert outcome.error == 'the base shakes: hold it still to locate a wall'


def test_locating_moves_nothing_and_leaves_content_to_read(written):
    element = written(3)
    before = first(element)
    located(element)
    assert first(element) == pytest.approx(before, abs=0.05)  # it still rings a little
    assert rig.succeed(element, Read()).level == 3


def test_noise_widens_error(written):
    quiet, loud = written(2), written(2)
    loud.set_faults(Faults(sensor_noise=2e-5, seed=1))
    told = [located(each) for each in (quiet, loud)]
    assert told[1]['position_std'] > told[0]['position_std']
    assert told[1]['position'] == pytest.approx(first(loud), abs=MOST * told[1]['position_std'])
