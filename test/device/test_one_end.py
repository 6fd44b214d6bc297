# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One end is wrong: late, silent, early. No level turns into another, whichever end names it."""

import dataclasses
import itertools

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
from sampled import sampled

from mlmem import (
    UNDECODABLE,
    Calibration,
    Read,
    SettingsError,
    factory_calibration,
    new_element,
    preset,
)
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End
from mlmem.physics import CASE_II, Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.presets import PRESETS
from mlmem.readers.calibration import DelayTable
from mlmem.readers.decoding import decode_echoes, find_exchanged_levels
from mlmem.readers.echo import Echo, detection_threshold

from . import rig

NAMES = ('left', 'right', 'both')


class Late(Simulation):
    """An element one of whose sensors answers late."""

    def __init__(self, design, time, end, late):
        super().__init__(Simulation.of(design, time).chain)
        self._row, self._late = end.row, round(late / self.dt)
        self._before = np.zeros(self._late)

    def place(self, v, design):
        self.chain.place(v)
        self._before[:] = v[0 if self._row == 0 else design.N - 1]

    def advance(self, *args, **named):
        ends = super().advance(*args, **named)
        known = np.concatenate((self._before, ends[self._row]))
        self._before = known[len(known) - self._late :]
        ends[self._row] = known[: ends.shape[1]]
        return ends


def late(name, level, end, by):
    """Return an element with its wall at a level, and one sensor late."""
    design, settings = preset(name)
    calibration = factory_calibration(design, settings)
    driver = Late(design, settings.time, end, by)
    element = new_element(design, settings, calibration, driver)
    driver.place(find_pinned_wall(Specimen(design), level), design)
    element.transducer.assume_equilibrium()
    return element


@pytest.mark.parametrize('by', [22.0, 25.0, 28.0])
def test_right_sensor_late_by_level_gives_no_level(by):
    """It hears level 0, and at the left that is 3 time units from level 1."""
    outcome = rig.run(late('bits_1', 1, End.RIGHT, by), Read())
    assert not outcome.success
    assert 'the left end does not tell it from level 1' in outcome.error
    assert rig.run(late('bits_1', 1, End.RIGHT, 0.0), Read()).reading.level == 1


@pytest.mark.parametrize(
    'name', [name for name in PRESETS if preset(name).settings.read.method == 'delay']
)
def test_no_calibration_that_ships_lets_one_end_change_level(name):
    design, settings = preset(name)
    calibration = factory_calibration(design, settings)
    for names in NAMES:
        read = dataclasses.replace(settings.read, end=names)
        assert (
            find_exchanged_levels(design, dataclasses.replace(settings, read=read), calibration)
            == []
        )


def heard(end, probe, crossings):
    """Return an echo with these crossings of the thresholds, or silence."""
    t = np.arange(0.5, 1400.0, 0.5)
    ratio = np.zeros_like(t)
    if crossings is not None:
        low, delay, high = crossings
        for time, least in ((low, 0.9), (delay, 1.1), (high, 3.0)):
            ratio[t >= (delay if time is None else time)] = least
    v_c = ratio * detection_threshold(probe, t)
    over = ratio > 1.0
    delay = float(t[over.argmax()]) if over.any() else None
    return Echo(end, probe, t, v_c, v_c, delay, float(ratio.max()))


@pytest.mark.parametrize('names', NAMES)
@pytest.mark.parametrize('name', sampled(
    ['case_2', 'bits_1', 'bits_2', 'bits_4', 'kick_4'],
    lambda name: name in ('bits_1', 'bits_2'),
))  # fmt: skip
def test_any_error_of_one_end_gives_true_level_or_none(name, names):
    """A delay of any size, early ones too, swept over all delays that the table has; silence."""
    design, settings = preset(name)
    read = dataclasses.replace(settings.read, end=names)
    calibration = factory_calibration(design, settings)
    right = 0
    for wrong in End:
        honest, table = wrong.opposite, calibration.table(wrong)
        probes = {end: end.probe(settings) for end in End}
        sweep = [(t - 2.0, t, t + 3.0) for t in np.arange(60.0, table.longest + 60.0, 3.0)]
        sweep += [table.find_crossings(level) for level in range(design.levels)]
        said = [(each, heard(wrong, probes[wrong], each)) for each in (None, *sweep)]
        for true in range(0, design.levels, max(1, design.levels // 4)):
            sound = calibration.table(honest).find_crossings(true)
            good = heard(honest, probes[honest], sound)
            for each, bad in said:
                echoes = {honest: good, wrong: bad}
                level = decode_echoes(design, read, calibration, echoes, (1, 0)).level
                assert level in (true, UNDECODABLE), (wrong, true, each)
                right += level == true
    assert right > 0


@rig.unhurried
@hypothesis.given(
    st.lists(st.integers(1, 60), min_size=2, max_size=6),
    st.lists(st.integers(1, 60), min_size=2, max_size=6),
    st.floats(0.0, 0.9),
    st.sampled_from(NAMES),
)
def test_no_table_at_all_lets_one_end_change_level(left, right, margin, names):
    """Levels may be as near each other, and as unevenly spaced, as they like."""
    design = CASE_II
    n = min(len(left), len(right))
    one = DelayTable(tuple(130.0 + float(sum(left[:k])) for k in range(n)))
    other = DelayTable(tuple(900.0 - float(sum(right[:k])) for k in range(n)))
    _, settings = preset('case_2')
    read = dataclasses.replace(settings.read, end=names, min_margin=margin)
    found = find_exchanged_levels(
        dataclasses.replace(design, N=25 * (n + 1)),
        dataclasses.replace(settings, read=read),
        Calibration(one, other),
    )
    assert found == []


def test_levels_alike_at_end_are_found_and_not_read():
    """Both hidden by the pulse, as in an element whose first two walls are too near."""
    design, settings = preset('bits_2')
    known = factory_calibration(design, settings)
    alike = dataclasses.replace(
        known.left,
        delays=(known.left.delays[0], *known.left.delays[:1], *known.left.delays[2:]),
        shapes=(known.left.shapes[0], *known.left.shapes[:1], *known.left.shapes[2:]),
    )
    calibration = dataclasses.replace(known, left=alike)
    found = find_exchanged_levels(design, settings, calibration)
    assert {(end, true) for end, said, true in found if said == UNDECODABLE} == {
        (End.RIGHT, 0), (End.RIGHT, 1),
    }  # fmt: skip
    with pytest.raises(SettingsError, match='delays must rise or fall'):
        alike.check()


def test_calibration_of_one_end_alone_proves_nothing():
    """Its error turns any level into any other, and none confirms it."""
    design, settings = preset('bits_2')
    known = factory_calibration(design, settings)
    found = find_exchanged_levels(design, settings, dataclasses.replace(known, left=None))
    assert {(said, true) for _, said, true in found} == set(itertools.permutations(range(4), 2))
    assert {end for end, *_ in found} == {End.RIGHT}
