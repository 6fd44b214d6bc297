# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Routes from level to level; kicks whose speed selects the level, which need no strain."""

import itertools

import numpy as np
import pytest
import rig
from suite import expect_rejection

from mlmem import (
    BLANK,
    ELEMENT_NAMES,
    Calibrate,
    Erase,
    Kick,
    Read,
    Refused,
    SelfTest,
    SetMethod,
    SetStrain,
    Write,
    load_element,
)
from mlmem.instrument.blocks import run, wait
from mlmem.moves.kick import KickMotion, KickSettings, kick_out, kick_to, remove_missed_kicks
from mlmem.moves.move import Move, blank_content, find_route, move_families
from mlmem.physics import Scatter, draw_specimen, find_walls
from mlmem.readers.delay_reader import search_speed

CELL = 1.5
"""A resting wall is at most this far from its level, in cells."""


def element(name, write=None, **changes):
    """Return a blank element that is written by kicks, with changed settings by group."""
    return rig.shipped(name, write={'method': 'kick', **(write or {})}, **changes)


@pytest.mark.parametrize(('late', 'peak', 'error'), [(0.0, 1.5, 1e-4), (0.7, None, 1e-3)])
def test_kick_is_smooth_ramp_then_held(late, peak, error):
    """A late kick begins slowly, and has a jerk where it ends."""
    shape = KickSettings(late=late, hold=20.0)
    motion = KickMotion(-1.0, 1.0, 0.1, shape)
    t = np.linspace(0.0, motion.duration, 4001)
    x, v = motion.evaluate_motion(t)
    assert motion.duration == pytest.approx(40.0)
    assert (x[0], x[-1]) == pytest.approx((-1.0, 1.0))
    assert v.max() == pytest.approx(0.1 * (peak or shape.peak_speed_ratio), rel=1e-4)
    assert (v >= 0.0).all()
    assert not v[t > 20.0].any()
    assert (t[v.argmax()] > 12.0) == (late > 0.0)
    assert np.allclose(np.gradient(x, t)[1:-1], v[1:-1], atol=error)


@pytest.mark.parametrize('speed', [0.2, 0.45])
@pytest.mark.parametrize('scatter', [5e-4, 1e-2])
def test_kick_out_of_scattered_element_leaves_blank(speed, scatter):
    """The speed as shipped is 0.3; alpha, springs and masses scatter by as much each."""
    design = load_element('kick_2').design
    made = draw_specimen(design, Scatter(alpha=scatter, k_r=scatter, mass=scatter), 1)
    for start in range(design.levels):
        erased = rig.pin(rig.shipped('kick_2', made, kick={'erase_speed': speed}), start)
        run(erased, kick_out(erased))
        assert rig.true_level(erased, CELL) == BLANK


@pytest.mark.parametrize(
    ('name', 'start', 'speed', 'present', 'attempts'),
    [('case_2', 6, 0.03, True, 1), ('kick_2', 3, 0.01, False, 2)],
)
def test_erase_after_kink_that_stopped_short_leaves_blank(name, start, speed, present, attempts):
    """Wall and kink are inside, and both ends as those of a blank element, which at first is only
    read. Without an actuator kicks take a second attempt.
    """
    short = rig.pin(element(name, actuator={'present': present}), start)
    run(short, kick_to(short, short.design.D_s1, speed))
    run(short, wait(short, 3000.0))
    assert len(find_walls(short.design, short.chain.configuration)) == 2
    assert rig.succeed(short, Erase()).attempts == attempts
    assert rig.true_level(short, CELL) == BLANK


@pytest.mark.parametrize('gain', [1.0, 0.0])
def test_erase_kicks_until_the_element_is_blank(gain):
    """A blank element is only read. A transducer that moves nothing is tried three times."""
    erased = rig.pin(element('kick_2', actuator={'present': False}, write={'attempts': 3}), 2)
    rig.set_faults(erased, transducer_gain=gain, transducer_end='left')
    outcome = erased.perform(Erase())
    assert outcome.success == bool(gain)
    assert outcome.attempts == erased.statistics.cycles == (1 if gain else 3)
    if gain:
        assert erased.perform(Erase()).attempts == erased.statistics.cycles == 1


def test_kick_by_hand_leaves_wall_unknown_until_read():
    """The kick of a level's speed sends the wall there, the next one a kink that takes it away.
    A strain is released first.
    """
    kicked = element('case_2')
    kicked.perform(Read())
    shape = kicked.settings.kick
    for speed, expected in ((shape.wall_speeds[3], 3), (shape.erase_speed, BLANK)):
        begun = kicked.ticks
        outcome = kicked.perform(Kick(speed))
        assert (outcome.success, outcome.reading, kicked.reading) == (True, None, None)
        assert (kicked.unknown.reason, kicked.unknown.since) == ('kicked by hand', begun)
        assert kicked.perform(Read()).level == rig.true_level(kicked, CELL) == expected
    kicked.apply(SetStrain(0.01))
    kicked.advance(200)
    assert kicked.perform(Kick(shape.wall_speeds[3])).success
    assert kicked.actuator.strain == 0.0
    assert kicked.perform(Read()).level == 3


def test_kick_by_hand_beyond_the_stroke_is_refused():
    refusing = element('case_2', transducer={'max_stroke': 1.0})
    refusing.perform(Read())
    with expect_rejection(Refused, 'unsupported', 'transducer.max_stroke'):
        refusing.apply(Kick(0.05))
    assert (refusing.procedure, refusing.reading.level) == ('', BLANK)


def test_element_without_actuator_does_everything_but_strain():
    alone = element('case_2', actuator={'present': False})
    with expect_rejection(Refused, 'unsupported', 'actuator.present'):
        alone.apply(SetStrain(0.01))
    with expect_rejection(Refused, 'conflict', 'write.method'):
        alone.apply(SetMethod('strain'))
    for command in (Write(5), Write(2), Erase()):
        assert alone.perform(command).success
    for command in (Calibrate(), SelfTest()):
        small = element('kick_2', actuator={'present': False})
        outcome = rig.succeed(small, command)
        assert 'actuator' not in [check.name for check in outcome.checks]
        assert outcome.reading.level == rig.true_level(small, CELL) == BLANK
        assert small.actuator.motion.duration == 0.0  # it never strained


def test_calibration_of_level_without_kick_uses_step():
    """In this element every kick stops before level 1 or beyond it."""
    odd = element('kick_2')
    odd.chain.set_specimen(draw_specimen(odd.design, Scatter(offset=3e-3), 0))
    rig.succeed(odd, Calibrate())
    steps = odd.calibration.pulse_corrections.steps
    assert [at for at, step in enumerate(steps) if not step.speed] == [1]
    known = remove_missed_kicks(odd.settings, odd.pulse_corrections)
    assert find_names(odd.design, known, BLANK, 1) == ['kick', 'step up']
    assert rig.succeed(odd, Write(1)).attempts == 1
    assert rig.true_level(odd, CELL) == 1


def test_stuck_actuator_is_left_alone_by_kicks():
    """With kicks it is not used; auto finds out, where a step would be fastest, and kicks."""
    stuck = rig.pin(element('kick_2', write={'method': 'auto'}), 1)
    assert find_route(stuck.design, stuck.settings, 1, 2)[0].needs_actuator
    rig.set_faults(stuck, actuator_stuck=True)
    for command in (Write(2), Erase(), SetMethod('kick'), Write(1)):
        if isinstance(command, SetMethod):
            stuck.apply(command)
        else:
            rig.succeed(stuck, command)
    assert rig.true_level(stuck, CELL) == 1
    tested = stuck.perform(SelfTest())
    assert rig.failed_checks(tested) == ['actuator']
    assert 'level 3' in [check.name for check in tested.checks]
    stuck.apply(SetMethod('strain'))
    assert 'needs strain, and the actuator does not follow' in stuck.perform(Write(3)).error


@pytest.mark.parametrize('speed', [0.0645, 0.098])
def test_kick_that_missed_its_level_is_corrected(speed):
    """Just below the window of level 4 the wall stops at level 3, just above it at 5."""
    speeds = [*load_element('case_2').settings.kick.wall_speeds]
    speeds[4] = speed
    missing = element('case_2', kick={'speeds': ' '.join(map(str, speeds))})
    assert rig.succeed(missing, Write(4)).attempts == 2
    assert rig.true_level(missing, CELL) == 4
    assert missing.chain.V_N == 0.0


@pytest.mark.parametrize('wrong', [0.75, 1.3])
def test_calibration_learns_speeds_by_bisection(wrong):
    """With all speeds wrong alike, as by a wrong gain, whose kicks end up to two levels off."""
    right = load_element('kick_2').settings.kick.wall_speeds
    learning = element('kick_2', kick={'speeds': ' '.join(f'{wrong * each:g}' for each in right)})
    outcome = rig.succeed(learning, Calibrate())
    assert outcome.end_tick - outcome.start_tick < 1000  # two seconds at 0.1 ms a time unit
    for target in (3, 0, 2, 1):
        assert rig.succeed(learning, Write(target)).attempts == 1
        assert rig.true_level(learning, CELL) == target


@pytest.mark.parametrize(
    ('sides', 'powers'),
    [
        ((-1, -1, -1), [0, 1, 2, 3]),  # the speed is faster, or slower and then between two
        ((1, 1, 1, 1, -1), [0, -1, -2, -3, -4, -3.5]),
        # A kick that was not heard may have had the right speed: only the next one tells.
        ((0, 0), [0, -1, -2]),
        ((0, -1), [0, -1, 0]),
        ((0, 1), [0, -1, -2]),
        # All faster kicks have fallen short, or all slower ones have gone too far.
        ((-1,) * 8, [*range(7), -1, -2]),
        ((-1,) * 7 + (1,), [*range(7), -1, 0]),
        ((1,) * 9, [*range(0, -7, -1), 1, 2, 3]),
        ((1,) * 7 + (-1, -1), [*range(0, -7, -1), 1, 0, -1]),
    ],
)
def test_kick_search_brackets_the_speed_on_either_side(sides, powers):
    """The sides to which the wall goes, and the speeds that are tried, as powers of 1.1.

    It steps by a tenth up to a factor of 1.8, then on the other side, and halves a bracket.
    """
    search = search_speed(1.0, tries=20)
    tried = [next(search), *(search.send((0.0, side)) for side in sides)]
    assert tried == pytest.approx(np.power(1.1, powers))
    with pytest.raises(StopIteration) as stop:
        search.send((1.0, 0))
    assert stop.value.value is True


@pytest.mark.parametrize(('margin', 'arrived'), [(0.45, True), (0.35, False)])
def test_kick_search_returns_to_the_nearest_speed_once(margin, arrived):
    """The second of three kicks came nearest, with a margin of 0.5."""
    search = search_speed(1.0, tries=3)
    speeds = [next(search), *(search.send((each, -1)) for each in (0.2, 0.5, 0.3))]
    assert speeds == pytest.approx(np.power(1.1, [0, 1, 2, 1]))
    with pytest.raises(StopIteration) as stop:
        search.send((margin, -1))
    assert stop.value.value is arrived


def find_names(design, settings, start, target):
    return [move.name for move in find_route(design, settings, start, target)]


@pytest.mark.parametrize('name', ELEMENT_NAMES)
def test_every_place_can_be_reached(name):
    design, settings = load_element(name).design_and_settings
    places = [blank_content(settings), 0, design.levels // 2, design.levels - 1]
    for start, target in itertools.permutations(set(places), 2):
        way = find_route(design, settings, start, target)
        assert [move.start for move in way] == [start, *(move.target for move in way[:-1])]
        assert way[-1].target == target


def test_move_of_another_family_is_planned_and_driven(monkeypatch):
    """A move that puts the wall to its level at once."""

    def lift_up(design, settings, start, target):
        def lift(element, how):
            element.begin_cycle('lifted')
            rig.pin(element, target)
            yield 2

        is_possible = BLANK < start < target
        return [Move('lift', start, target, 40.0, lift)] if is_possible else []

    families = (*move_families(), lift_up)
    monkeypatch.setattr('mlmem.moves.move.move_families', lambda: families)
    written = rig.shipped('case_2')
    assert find_names(written.design, written.settings, 1, 6) == ['lift']
    assert find_names(written.design, written.settings, BLANK, 2) == ['launch', 'lift']
    rig.succeed(written, Write(1))
    lifted = rig.succeed(written, Write(6))
    assert (lifted.attempts, lifted.reading.level) == (1, 6)


@pytest.mark.parametrize(
    ('name', 'method', 'changes', 'start', 'target', 'names'),
    [
        ('case_2', 'kick', {}, BLANK, 5, ['kick']),
        ('case_2', 'kick', {}, 5, 3, ['kick out', 'kick']),
        ('case_2', 'kick', {}, 4, BLANK, ['kick out']),
        # No kick reaches level 2.
        ('case_2', 'kick', {'kick': {'speeds': '0.006 0.0145 0 0.053'}}, BLANK, 2,
         ['kick', 'step up']),
        # A margin below a tenth is not used.
        ('case_2', 'kick', {'kick': {'speed_margins': '0.5 0.5 0.1'}}, BLANK, 2, ['kick']),
        ('case_2', 'kick', {'kick': {'speed_margins': '0.5 0.5 0.09'}}, BLANK, 2,
         ['kick', 'step up']),
        # 0.18 on average, 0.27 at most; erasing it is 0.45 at most.
        ('case_2', 'kick', {'transducer': {'max_speed': 0.25}}, BLANK, 6, ['kick', 'step up']),
        ('case_2', 'kick', {'transducer': {'max_speed': 0.25}}, 5, BLANK, ['kink drive']),
        ('case_2', 'strain', {}, BLANK, 0, ['launch']),
        ('case_2', 'strain', {}, BLANK, 1, ['launch', 'step up']),
        ('case_2', 'strain', {}, 1, 0, ['kink drive', 'launch']),
        ('bits_4', 'strain', {}, 2, 5, ['step up'] * 3),
        ('bits_4', 'strain', {}, 4, 4, []),
        ('bits_4', 'strain', {}, 3, 2, ['kink drive', 'launch', 'step up', 'step up']),
        # Two steps take 880 time units, and three 1320; both kicks take 1100 to 1140.
        ('kick_2', 'auto', {}, 0, 2, ['step up'] * 2),
        ('kick_2', 'auto', {}, 0, 3, ['kick out', 'kick']),
        # In a byte the levels are the bits: walls are added, or all are cleared first.
        ('byte', 'kick', {}, 0b1000_0000, 0b1100_0001, ['kick'] * 2),
        ('byte', 'kick', {}, 0b1000_0001, 0b1100_0000, ['clearing pulse', *['kick'] * 2]),
        # Words of robust_words: only walls to the left of that at level 7 are missing.
        ('robust_words', 'kick', {}, 19, 27, ['kick'] * 2),
    ],
)  # fmt: skip
def test_method_decides_how_content_is_reached(name, method, changes, start, target, names):
    design, settings = load_element(name).design_and_settings
    settings = rig.change(settings, write={'method': method}, **changes)
    assert find_names(design, settings, start, target) == names
