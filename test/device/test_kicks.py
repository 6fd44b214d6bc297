# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Written without strain: a kick's speed selects the level, a kick of the other kind erases it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from sampled import sampled

from mlmem import (
    BLANK,
    Calibrate,
    Erase,
    Faults,
    MemoryElement,
    ProcedureFailed,
    Read,
    Refused,
    SelfTest,
    SetFaults,
    SetMethod,
    SetStrain,
    SettingsError,
    Write,
    factory_calibration,
    preset,
)
from mlmem.instrument.blocks import run, wait
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import Kick
from mlmem.move_settings import KickSettings
from mlmem.moves.kick import kick, kick_out, kick_to
from mlmem.moves.planner import find_route
from mlmem.physics import Scatter, find_level, find_walls, scattered
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.presets import use_kicks

KICKED = sampled(('kick_2', 'case_2', 'kick_4'), lambda name: name != 'kick_4')

CELL = 1.5
"""A resting wall is at most this far from its level, in cells."""


@cache
def calibration(name):
    return factory_calibration(*use_kicks(preset(name)))


def element(name, **changes):
    """Return a blank element that is written by kicks, with changed settings by group."""
    design, settings = use_kicks(preset(name))
    groups = {
        group: replace(settings.groups()[group], **values) for group, values in changes.items()
    }
    return MemoryElement(design, replace(settings, **groups), calibration(name))


def level(element):
    return find_level(element.design, element.chain.configuration, CELL)


def with_wall(element, at):
    element.chain.place(find_pinned_wall(element.chain.specimen, at))
    element.transducer.assume_equilibrium()
    return element


def test_a_kick_is_a_smooth_ramp_then_held():
    motion = Kick(-1.0, 1.0, 0.1, KickSettings(hold=20.0))
    t = np.linspace(0.0, motion.duration, 4001)
    x, v = motion.at(t)
    assert motion.duration == pytest.approx(40.0)
    assert (x[0], x[-1]) == pytest.approx((-1.0, 1.0))
    assert v.max() == pytest.approx(0.15, rel=1e-6)  # 1.5 times the mean
    assert not v[t > 20.0].any()
    assert np.allclose(np.gradient(x, t)[1:-1], v[1:-1], atol=1e-4)  # second order in the step


def test_a_late_kick_begins_slowly_and_never_turns_back():
    shape = KickSettings(late=0.7, hold=20.0)
    motion = Kick(-1.0, 1.0, 0.1, shape)
    t = np.linspace(0.0, motion.duration, 4001)
    x, v = motion.at(t)
    assert (x[0], x[-1]) == pytest.approx((-1.0, 1.0))
    assert v.max() == pytest.approx(0.1 * shape.peak_speed_ratio, rel=1e-4)
    assert (v >= 0.0).all()
    assert t[v.argmax()] > 12.0  # of 20
    assert np.allclose(np.gradient(x, t)[1:-1], v[1:-1], atol=1e-3)  # a jerk where it ends


@pytest.mark.parametrize('name', KICKED)
def test_the_speed_of_a_kick_selects_the_level(name):
    for target in range(preset(name).design.levels):
        kicked = element(name)
        run(kicked, kick(kicked, target))
        run(kicked, wait(kicked, 1500.0))  # three lifetimes 2 / eta: the wall rests within a cell
        assert level(kicked) == target
        assert kicked.chain.V_N == 0.0


@pytest.mark.parametrize('name', KICKED)
def test_kick_out_from_every_level_leaves_blank(name):
    for start in range(preset(name).design.levels):
        erased = with_wall(element(name), start)
        run(erased, kick_out(erased))
        assert level(erased) == BLANK
        assert erased.chain.V_N == 0.0


@pytest.mark.parametrize('speed', [0.2, 0.45])
@pytest.mark.parametrize('scatter', [5e-4, 3e-3, 1e-2])
def test_kick_out_of_scattered_element_leaves_blank(speed, scatter):
    """The speed as shipped is 0.3; alpha, springs and masses scatter by as much each."""
    design, settings = preset('kick_2')
    made = scattered(design, Scatter(alpha=scatter, k_r=scatter, mass=scatter), 1)
    settings = replace(settings, kick=replace(settings.kick, erase_speed=speed))
    for start in range(design.levels):
        driver = Simulation.of(made, settings.time)
        erased = with_wall(MemoryElement(design, settings, calibration('kick_2'), driver), start)
        run(erased, kick_out(erased))
        assert level(erased) == BLANK


def test_erase_of_blank_element_kicks_nothing():
    blank = element('kick_2')
    assert blank.perform(Erase()).success
    assert blank.statistics.cycles == 0


def test_erase_after_kink_that_stopped_short_leaves_blank():
    """Wall and kink are inside, and both ends as those of a blank element."""
    short = with_wall(element('case_2'), 6)
    run(short, kick_to(short, short.design.D_s1, 0.03))
    run(short, wait(short, 3000.0))
    assert len(find_walls(short.design, short.chain.configuration)) == 2
    outcome = short.perform(Erase())
    assert outcome.success, outcome.error
    assert level(short) == BLANK


@pytest.mark.parametrize('name', KICKED)
def test_writes_and_erases_are_verified_and_need_no_strain(name):
    kicked = element(name)
    top = kicked.design.levels - 1
    for target in (top, 1, top - 1, 0):
        outcome = kicked.perform(Write(target))
        assert outcome.success, outcome.error
        assert level(kicked) == target == outcome.reading.level
    assert kicked.perform(Erase()).success
    assert level(kicked) == BLANK
    assert kicked.actuator.strain == kicked.chain.V_N == 0.0


def test_the_method_decides_how_a_level_is_reached():
    design, kicks = use_kicks(preset('case_2'))
    for method, ways in {
        'kick': {
            (BLANK, 5): ['kick'],
            (5, 3): ['kick out', 'kick'],
            (4, BLANK): ['kick out'],
        },
        'strain': {(BLANK, 0): ['launch'], (BLANK, 1): ['launch', 'step up']},
    }.items():
        settings = replace(kicks, write=replace(kicks.write, method=method))
        for (start, target), way in ways.items():
            assert [move.name for move in find_route(design, settings, start, target)] == way
    auto = replace(kicks, write=replace(kicks.write, method='auto'))
    best = sum(move.duration for move in find_route(design, auto, BLANK, 7))
    for method in ('kick', 'strain'):
        settings = replace(kicks, write=replace(kicks.write, method=method))
        assert best <= sum(move.duration for move in find_route(design, settings, BLANK, 7))


def test_where_no_kick_reaches_strain_takes_over():
    design, settings = use_kicks(preset('case_2'))
    short = replace(settings, kick=KickSettings('0.006 0.0145 0 0.053'))
    first, *others = find_route(design, short, BLANK, 2)
    assert first.name == 'kick'
    assert all(move.needs_actuator for move in others)
    without = replace(short, actuator=replace(short.actuator, present=False))
    assert not any(move.needs_actuator for move in find_route(design, without, BLANK, 3))
    with pytest.raises(ProcedureFailed, match='level 2 is reached only by strain'):
        find_route(design, without, BLANK, 2)


def test_what_bears_less_than_a_tenth_is_not_used():
    design, settings = use_kicks(preset('case_2'))
    rooms = replace(settings.kick, rooms='0.5 0.5 0.09')
    narrow = replace(settings, kick=rooms)
    assert [move.name for move in find_route(design, settings, BLANK, 2)] == ['kick']
    assert any(move.needs_actuator for move in find_route(design, narrow, BLANK, 2))
    assert [move.margin for move in find_route(design, narrow, BLANK, 1)] == [0.5]
    assert [move.margin for move in find_route(design, narrow, BLANK, 3)] == [1.0]  # not known


def test_kicks_keep_to_the_limits_of_the_transducer():
    design, settings = use_kicks(preset('case_2'))
    slow = replace(settings, transducer=replace(settings.transducer, max_speed=0.25))
    way = find_route(design, slow, BLANK, 6)  # 0.18 on average, 0.27 at most
    assert [move.name for move in way] != ['kick']
    assert [move.name for move in find_route(design, slow, 5, BLANK)] == ['erase']  # 0.45 at most


def test_without_an_actuator_everything_but_strain_works():
    alone = element('case_2', actuator={'present': False})
    with pytest.raises(Refused, match='a strain needs an actuator'):
        alone.apply(SetStrain(0.01))
    for command in (Write(5), Write(2), Erase()):
        assert alone.perform(command).success
    for command in (Calibrate(), SelfTest()):
        small = element('kick_2', actuator={'present': False})
        outcome = small.perform(command)
        assert outcome.success, outcome.error
        assert 'actuator' not in [check.name for check in outcome.checks]
        assert small.actuator.motion.duration == 0.0  # it never strained
    faint = element('case_2', actuator={'present': False}, transducer={'max_speed': 0.01})
    with pytest.raises(Refused, match='level 5 is reached only by strain'):
        faint.perform(Write(5))


def test_write_method_strain_without_an_actuator_is_rejected():
    with pytest.raises(SettingsError, match=r'write.method must be kick or auto .*actuator'):
        element('case_2', write={'method': 'strain'}, actuator={'present': False})
    alone = element('case_2', actuator={'present': False})
    with pytest.raises(Refused, match=r'^write.method must be kick or auto'):
        alone.apply(SetMethod('strain'))
    assert alone.settings.write.method == 'kick'
    assert alone.perform(Write(2)).success


@pytest.mark.parametrize('seed', [1, 2, 3])
def test_without_an_actuator_a_wall_that_ran_out_at_the_right_comes_back(seed):
    """Too fast a kick takes the free end over into a third ground state; a kink follows it."""
    design, _ = use_kicks(preset('case_2'))
    alone = element('case_2', actuator={'present': False})
    alone.chain.set_specimen(scattered(design, Scatter(alpha=3e-4, k_r=3e-4), seed))
    run(alone, kick(alone, 7, 1.5))
    run(alone, wait(alone, 3000.0))  # until it stands still
    assert np.abs(alone.chain.configuration - design.D_s1).min() > 1.0  # no cell is inactive
    for command in (Erase(), Write(4)):
        outcome = alone.perform(command)
        assert outcome.success, outcome.error
    assert level(alone) == 4


def test_calibration_of_a_level_without_kick_uses_a_step():
    """In this element every kick stops before level 1 or beyond it."""
    design, _ = preset('kick_2')
    odd = element('kick_2')
    odd.chain.set_specimen(scattered(design, Scatter(offset=3e-3), 0))
    calibrated = odd.perform(Calibrate())
    assert calibrated.success, calibrated.error
    steps = odd.calibration.pulse_corrections.steps
    assert [at for at, step in enumerate(steps) if not step.speed] == [1]
    known = odd.calibration.remove_missed_kicks(odd.settings)
    assert [move.name for move in find_route(design, known, BLANK, 1)] == ['kick', 'step up']
    outcome = odd.perform(Write(1))
    assert outcome.success
    assert outcome.attempts == 1
    assert level(odd) == 1


def test_a_stuck_actuator_is_as_good_as_none():
    """With kicks it is not asked; auto finds out and goes on by kicks."""
    stuck = element('kick_2', write={'method': 'auto'})
    stuck.apply(SetFaults(Faults(actuator_stuck=True)))
    for command in (Write(2), Erase(), SetMethod('kick'), Write(1), Calibrate()):
        if isinstance(command, SetMethod):
            stuck.apply(command)
        else:
            outcome = stuck.perform(command)
            assert outcome.success, outcome.error
    checks = {check.name: check.passed for check in stuck.perform(SelfTest()).checks}
    assert [name for name, passed in checks.items() if not passed] == ['actuator']
    assert 'level 3' in checks


def test_auto_leaves_an_actuator_alone_that_does_not_follow():
    """Where a step would be fastest, it finds out, and kicks."""
    stuck = with_wall(element('kick_2', write={'method': 'auto'}), 1)
    design, settings = stuck.design, stuck.settings
    assert find_route(design, settings, 1, 2)[0].needs_actuator
    stuck.apply(SetFaults(Faults(actuator_stuck=True)))
    outcome = stuck.perform(Write(2))
    assert outcome.success, outcome.error
    assert level(stuck) == 2
    stuck.apply(SetMethod('strain'))
    failed = stuck.perform(Write(3)).error
    assert 'needs strain, and the actuator does not follow' in failed


def test_the_method_can_be_changed_while_time_runs():
    by_strain = element('case_2', write={'method': 'strain'})
    by_strain.apply(SetMethod('kick'))
    assert by_strain.perform(Write(3)).success
    assert by_strain.chain.V_N == 0.0
    with pytest.raises(Refused, match='method must be one of strain, kick, auto'):
        by_strain.apply(SetMethod('luck'))


@pytest.mark.parametrize('speed', [0.0645, 0.098])
def test_a_kick_that_went_astray_is_corrected_by_what_was_heard(speed):
    """Just below the window of level 4 the wall stops at level 3, just above it at 5."""
    speeds = [*preset('case_2').settings.kick.wall_speeds]
    speeds[4] = speed
    astray = element('case_2', kick={'speeds': ' '.join(map(str, speeds))})
    outcome = astray.perform(Write(4))
    assert outcome.success
    assert outcome.attempts == 2
    assert level(astray) == 4
    assert astray.chain.V_N == 0.0


@pytest.mark.parametrize('wrong', [0.75, 1.3])
def test_a_calibration_learns_the_speeds_by_bisection(wrong):
    """With all speeds wrong alike, as by a wrong gain, whose kicks end up to two levels astray."""
    right = preset('kick_2').settings.kick.wall_speeds
    learning = element('kick_2', kick={'speeds': ' '.join(f'{wrong * each:g}' for each in right)})
    outcome = learning.perform(Calibrate())
    assert outcome.success, outcome.error
    assert outcome.end_tick - outcome.start_tick < 1000  # two seconds at 0.1 ms a time unit
    for target in (3, 0, 2, 1):
        outcome = learning.perform(Write(target))
        assert outcome.attempts == 1, outcome.error
        assert level(learning) == target


def test_a_calibration_learns_the_speeds_of_an_element_with_one_per_cent_of_disorder():
    design, settings = preset('kick_2')
    made = scattered(design, Scatter(alpha=0.01), 0)
    driver = Simulation.of(made, settings.time)
    learning = MemoryElement(design, settings, calibration('kick_2'), driver)
    assert learning.perform(Calibrate()).success
    learnt = learning.calibration.pulse_corrections
    assert learnt.steps[0].speed < 0.8  # as set, the first level would be missed
    for target in (0, 3, 1, 2):
        assert learning.perform(Write(target)).success
        assert find_level(design, learning.chain.configuration, design.J / 2) == target


def test_a_wall_that_swings_in_its_place_teaches_nothing():
    """Alpha scatters by less than a kick bears: no speed is changed, and no level is kicked twice.

    Heard at once, while it swings, a wall was taken for one that stopped on its way.
    """
    design, settings = use_kicks(preset('case_2'))
    driver = Simulation.of(scattered(design, Scatter(alpha=3e-4), 1), settings.time)
    learning = MemoryElement(design, settings, calibration('case_2'), driver)
    outcome = learning.perform(Calibrate())
    assert outcome.success, outcome.error
    assert learning.calibration.pulse_corrections is None
    kicks = learning.design.levels
    assert learning.statistics.cycles <= 2 * kicks + 2  # an erase between two, one to restore


def test_a_wall_that_swings_after_a_kick_is_heard_again():
    """At once its left echo is 9 time units early, and the right one disagrees."""
    swinging = element('case_2')
    run(swinging, kick(swinging, 2))
    assert swinging.perform(Read()).reading.level == 2


@pytest.mark.parametrize('speeds', ['fast', '0.1 -1', '11', '0.1, 0.2', 'nan', '1e-9'])
def test_speeds_that_are_none_are_refused(speeds):
    with pytest.raises(SettingsError, match='speeds must be 0 or from 1e-4 to 10'):
        KickSettings(speeds)
