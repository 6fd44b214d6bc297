# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads from both ends: one wall, two, three or none, on the real material."""

from dataclasses import replace

import numpy as np
import pytest

from mlmem import UNDECODABLE, EchoReceived, Read, SelfTest, SetStrain, Write, new_element, preset
from mlmem.instrument.end import End
from mlmem.physics import Specimen, find_walls
from mlmem.physics.equilibrium import relax_to_equilibrium
from mlmem.settings import ReadSettings

from . import rig


def with_walls(*defects, first_active=True, **settings):
    """Return a device at rest whose phase changes at these defects."""
    design = rig.DESIGN
    step = design.D_s2 - design.D_s1
    v = np.full(design.N, design.D_s2 if first_active else design.D_s1)
    for count, defect in enumerate(defects):
        down = (count % 2 == 0) == first_active
        rise = 0.5 * (1.0 + np.tanh((design.sites - defect - 0.3) / 3.0))
        v += (-step if down else step) * rise
    element = rig.device(**settings)
    element.chain.place(relax_to_equilibrium(Specimen(design), v, np.zeros(design.N)))
    element.transducer.assume_equilibrium()
    found = [wall.position for wall in find_walls(design, element.chain.configuration)]
    assert found == pytest.approx(defects, abs=1.0), 'it does not rest there'
    return element


@pytest.mark.parametrize('level', range(4))
def test_one_wall_is_same_from_both_ends(written, level):
    element = written(level)
    told = rig.events(element, Read('both'))
    left, right = (event for event in told if isinstance(event, EchoReceived))
    assert {left.echo.end, right.echo.end} == set(End)
    if left.echo.end == 'right':
        left, right = right, left
    reading = told[-1].reading
    assert reading == left.reading == right.reading == element.reading
    assert (reading.level, reading.code, reading.walls) == (level, f'{level:02b}', 1)
    assert (reading.end, reading.delay) == ('both', left.echo.delay)
    assert (reading.left_delay, reading.right_delay) == (left.echo.delay, right.echo.delay)
    assert reading.threshold_margin == min(left.echo.threshold_margin, right.echo.threshold_margin)
    assert reading.level_margin > 0.7
    # interpolated between levels by the delay: as near as the delay is to its own
    assert 1.0 + reading.distance == pytest.approx(rig.wall(element), abs=0.15 * 25)
    assert rig.holds(element, level)


@pytest.mark.parametrize('names', ['left', 'right'])
@pytest.mark.parametrize(
    ('defects', 'end'),
    [
        ((25, 75, 100), 'left'),
        ((25, 50, 100), 'right'),
        ((25, 50, 75), 'both'),
        ((50, 75, 100), ''),
    ],
)
def test_three_walls_are_no_level_from_any_end(defects, end, names):
    """Active, inactive, active, inactive: the ends rest as those of a stored level do.

    A read probes both ends whichever is asked for: that is the one whose delay it reports.
    """
    first, last = defects[0] // 25 - 1, defects[-1] // 25 - 1
    element = with_walls(*defects, read=ReadSettings(end=names))
    outcome = rig.run(element, Read(end))
    assert (outcome.reading.level, outcome.reading.walls) == (UNDECODABLE, 3)
    here = first if names == 'left' else last
    assert f'wall at level {here}' in outcome.error
    assert outcome.reading.confidence == 0.0


@pytest.mark.parametrize(
    ('first_active', 'defects', 'heard', 'end'),
    [
        (False, (50, 100), 3, 'left'),
        (False, (25, 100), 3, 'right'),
        (False, (25, 50), 1, 'both'),
        (True, (25, 75), 0, ''),
        (True, (75, 100), 2, 'right'),
    ],
)
def test_stretch_of_other_phase_is_two_walls(first_active, defects, heard, end):
    """An active one is heard from the right alone: the left carrier does not pass the other."""
    outcome = rig.run(with_walls(*defects, first_active=first_active), Read(end))
    assert not outcome.success
    assert outcome.reading.walls == 2
    assert f'a wall at level {heard}: there are two walls' in outcome.error


@pytest.mark.parametrize(
    ('name', 'method', 'start', 'level'), [('bits_2', 'kick', 1, 3), ('bits_4', 'strain', 5, 6)]
)
def test_swinging_wall_is_read_again_and_not_moved_again(name, method, start, level):
    """Its first echoes disagree: it is half a cell off, and radiates what the far end hears."""
    design, settings = preset(name)
    element = new_element(design, replace(settings, write=replace(settings.write, method=method)))
    element.perform(Write(start))
    *told, outcome = rig.events(element, Write(level))
    first, _, second, _ = (event.reading for event in told)
    assert first.level == UNDECODABLE
    assert None not in (first.left_delay, first.right_delay)
    assert second.level == level
    assert (outcome.success, outcome.attempts) == (True, 1)
    assert rig.holds(element, level)


@pytest.mark.parametrize('command', [Write(2), SelfTest()], ids=['write', 'self-test'])
def test_procedure_that_writes_reads_first_as_read_does(written, command):
    """A wall that swings after a strain by hand says nothing at first; it is heard once more."""
    element = written(2)
    for strain in (0.03, 0.0):
        element.apply(SetStrain(strain))
        while element.actuator.is_moving:
            element.advance()
    cycles, readings = element.statistics.cycles, []
    element.apply(command)
    while len(readings) < 4 and element.procedure:
        told = element.advance()
        readings += [event.reading for event in told if isinstance(event, EchoReceived)]
    assert [reading.level for reading in readings] == [UNDECODABLE, UNDECODABLE, 2, 2]
    assert element.statistics.cycles == cycles
