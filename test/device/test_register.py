# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many walls in one element: a byte in the paper's second one, and words of robust cells."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import rig
from scipy.spatial.distance import cdist
from suite import expect_rejection, sampled

from mlmem import (
    UNDECODABLE,
    Abort,
    Calibrate,
    Disturb,
    Erase,
    Faults,
    Locate,
    MemoryElement,
    Read,
    Refused,
    SelfTest,
    Survey,
    Write,
    load_element,
    snapshot,
)
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End
from mlmem.instrument.instrument import Instrument
from mlmem.moves.kick import KickMotion
from mlmem.moves.move import erasing_moves
from mlmem.physics import Scatter, Specimen, draw_specimen, find_walls
from mlmem.physics.equilibrium import find_pinned_walls
from mlmem.readers.register import find_wall_levels, forecast_words
from mlmem.readers.words import Code

BYTE = load_element('byte')
NIBBLE = rig.first_levels('byte', 4)


def levels(element):
    """Return the levels at which a wall or a kink is, within a cell; None for others."""
    design, found = element.design, []
    for wall in find_walls(design, element.chain.configuration):
        near = min(range(design.levels), key=lambda n: abs(design.defect_site(n) - wall.position))
        found.append(near if abs(design.defect_site(near) - wall.position) < 1.0 else None)
    return sorted(found)


@pytest.mark.parametrize('spacing', [1, 2, 3])
def test_words_are_sets_of_levels_far_enough_apart(spacing):
    """Counted by trying all subsets of ten levels."""
    code = Code(10, spacing)
    legal = {
        chosen
        for number in range(11)
        for chosen in itertools.combinations(range(10), number)
        if all(b - a >= spacing for a, b in itertools.pairwise(chosen))
    }
    assert code.words == len(legal)
    assert {code.walls(word) for word in range(code.words)} == legal
    assert all(code.word(code.walls(word)) == word for word in range(code.words))
    assert Code(8, 1).walls(0b10100111) == (0, 1, 2, 5, 7)
    assert Code(8, 1).format_binary(0b00100111) == '00100111'  # all of 256 words have 8 digits
    assert Code(2, 2).format_binary(1) == '01'  # of three
    assert Code(16, 2).words == 2584  # Fibonacci's 18th number


@pytest.mark.parametrize(
    ('kind', 'words'),
    sampled([(NIBBLE, (0, 0x2, 0x5, 0xF)), (BYTE, range(256))], lambda each: each[0] is NIBBLE),
    ids=['4', '8'],
)
@pytest.mark.parametrize(('amplitude', 'error'), [(0.01, 0.004), (0.001, 8e-4)])
def test_forecasts_agree_with_simulated_waveforms(kind, words, amplitude, error):
    """Small waves, beside the simulated ends of an element with scattered cells: within 0.4 % of
    the pulse, and 0.08 % with a tenth of its amplitude, where walls are linear.
    """
    register = replace(kind.settings.register, A=amplitude)
    settings = replace(kind.settings, register=register)
    made = draw_specimen(kind.design, Scatter(alpha=1e-3, k_r=1e-3, mass=1e-3, offset=1e-3), 3)
    found = forecast_words(made, settings)
    for word in words:
        twin = Instrument(kind.design, settings, Simulation.build_blank(made, settings.time))
        rig.pin(twin, *found.code.walls(word))
        recorder = twin.transducer.record_pulse(End.LEFT, register.probe)
        twin.pass_ticks(found.listener.ticks)
        decoded_shots = found.listener.project_shot(recorder.shot(0.0, 0.0, twin.driver.dt))
        off = np.linalg.norm(found.parts[word] - decoded_shots) / np.linalg.norm(decoded_shots)
        assert off < error, word


@pytest.mark.parametrize('name', ['byte', 'robust_words'])
def test_limit_of_a_word_is_set_by_the_nearest_with_its_phases(name):
    """It is found in single precision, half of the words at a time. No wall between the levels of
    these elements is nearer to a word than the limit allows.
    """
    found = MemoryElement(load_element(name)).reader.forecasts
    apart, words = cdist(found.parts, found.parts), range(found.code.words)
    odd = np.array([len(found.code.walls(word)) % 2 for word in words])
    apart[(odd[:, None] != odd) | np.eye(len(words), dtype=bool)] = np.inf
    assert found.nearest_distances == pytest.approx(apart.min(axis=1), rel=1e-12)


@pytest.mark.parametrize(
    ('kind', 'words'), [(NIBBLE, (0x2, 0xF, 0x0, 0xA)), (BYTE, (0xA7, 0x5A))], ids=['4', '8']
)
def test_words_are_written_verified_and_read(kind, words):
    """One wall, as many as there may be, none, some; from each to the next, with no strain."""
    element, bits = MemoryElement(kind), kind.design.levels
    assert element.reader.content_count == 2**bits
    for word in words:
        rig.succeed(element, Write(word))
        assert levels(element) == [n for n in range(bits) if word >> n & 1]
        read = rig.succeed(element, Read())
        assert (read.reading.level, read.reading.code) == (word, f'{word:0{bits}b}')
        assert read.reading.walls == word.bit_count()
    assert element.actuator.strain == 0.0
    assert element.transmission.encoder_strain == 0.0
    other = MemoryElement(kind)
    snapshot.restore_snapshot(other, snapshot.take_snapshot(element))
    assert other.perform(Read()).reading.level == words[-1]
    assert element.perform(Erase()).success
    assert levels(element) == []
    assert element.perform(Read()).reading.level == 0


def test_kicks_alternate_between_walls_and_kinks():
    """One wall is kept, so the next to come is a kink, at the speed of kinks; no retry is needed.

    One kick is enough: a third of the time, and no clearing pulse.
    """
    byte = MemoryElement(BYTE)
    first = byte.perform(Write(0xA0))
    begun = byte.statistics.cycles
    for word in (0xA8, 0xAA):  # behind two walls, then behind three
        written = byte.perform(Write(word))
        assert (written.success, written.attempts) == (True, 1)
        assert written.end_tick - written.start_tick < 0.7 * (first.end_tick - first.start_tick)
    assert byte.statistics.cycles == begun + 2


def test_register_locates_all_walls_and_is_not_surveyed():
    byte = MemoryElement(BYTE)
    with expect_rejection(Refused, 'out_of_range', 'word'):
        byte.apply(Write(256))
    byte.place_content(0b1000_0101)
    found = byte.perform(Locate()).found
    assert found == {'walls': 3, 'cells': '25 75 200', 'kinds': 'wall kink wall'}
    assert byte.perform(Read()).success
    surveyed = byte.perform(Survey())
    assert not surveyed.success
    assert 'a survey drives one wall' in surveyed.error
    assert byte.reading.content == 0b1000_0101


def test_self_test_and_calibration_go_through_all_levels():
    nibble = MemoryElement(NIBBLE)
    nibble.place_content(0x9)
    tested = rig.succeed(nibble, SelfTest())
    assert [check.name for check in tested.checks if 'level' in check.name] == [
        f'level {n}' for n in range(4)
    ]
    assert tested.reading.level == 0x9
    assert rig.succeed(nibble, Calibrate()).reading.level == 0x9


def anywhere(rng):
    return int(rng.integers(2, NIBBLE.design.N))


@pytest.mark.parametrize(
    ('kind', 'count'), sampled([(NIBBLE, 5), (BYTE, 20)], lambda each: each[0] is NIBBLE),
    ids=['4', '8'],
)  # fmt: skip
@pytest.mark.parametrize(
    ('faults', 'share'),
    [
        (lambda rng: Faults(weak_cell=anywhere(rng), weak_factor=0.5), 0.0),
        (lambda rng: Faults(weak_cell=anywhere(rng), weak_factor=rng.uniform(0.01, 1.0)), 0.05),
        (lambda rng: Faults(stuck_cell=anywhere(rng)), 0.0),
        (lambda rng: Faults(disorder_alpha=1e-3, seed=anywhere(rng)), 1.0),
        (lambda rng: Faults(disorder_alpha=5e-3, seed=anywhere(rng)), 0.0),
        (lambda rng: Faults(sensor_noise=1e-5, seed=anywhere(rng)), 1.0),
        (lambda rng: Faults(sensor_dropout=0.02, seed=anywhere(rng)), 0.25),
        (lambda rng: Faults(damping_factor=rng.uniform(0.5, 8.0)), 0.0),
    ],
    ids=['weak', 'any', 'stuck', 'disorder', 'more', 'noise', 'freezing', 'damping'],
)
def test_no_fault_has_word_read_as_another(kind, count, faults, share):
    """What disorder of a thousandth and a thousandth of the pulse in noise leave is read, too."""
    element, rng, right = MemoryElement(kind), np.random.default_rng(5), 0
    for _ in range(count):
        word, given = int(rng.integers(element.reader.content_count)), faults(rng)
        element.set_faults(Faults())
        element.place_content(word)
        element.set_faults(given)
        read = element.perform(Read())
        element.transducer.release_ends()
        assert not read.success or read.reading.level == word, given
        right += read.success
    assert right >= share * count


@pytest.mark.parametrize(
    ('kind', 'cells'),
    [
        # Weak cells pull a wall for 10 to 15 cells; beyond, the lattice alone holds it.
        *((BYTE, (cell, 150.3)) for cell in (33, 58, 109, 180)),
        # Few words are far from one another: at 0.3 of that distance these were read as words.
        *((NIBBLE, cells) for cells in ((58, 100), (30.9, 75, 100), (50, 75, 89.7))),
    ],
)
def test_walls_between_levels_are_no_word_and_stay(kind, cells):
    element = rig.settle(MemoryElement(kind), find_pinned_walls(Specimen(kind.design), cells))
    assert find_wall_levels(kind.design, element.chain.configuration) is None
    read = element.perform(Read())
    assert (read.success, read.reading.level) == (False, UNDECODABLE)
    found = find_walls(kind.design, element.chain.configuration)
    assert sorted(wall.position for wall in found) == pytest.approx(sorted(cells), abs=1.0)


def test_shaken_element_is_not_read():
    """Harmless to the content, but louder than the difference of two words."""
    byte = MemoryElement(BYTE)
    byte.place_content(0x42)
    rng, harmless = np.random.default_rng(1), byte.settings.disturbance.safe_limit

    def shake():
        byte.base.accept_acceleration(float(rng.choice([-harmless, harmless])))

    for _ in range(60):
        shake()
        byte.advance()
    read = byte.perform(Read(), between=shake)
    assert (read.success, read.reading.level) == (False, UNDECODABLE)
    assert levels(byte) == [1, 6]


def test_ringing_element_is_read_at_one_tick_for_any_cut():
    """While the ends are to become quiet ticks are deferred; every tick is judged nevertheless."""
    told = []
    for between in (None, lambda: None):
        element = MemoryElement(BYTE)
        element.perform(Write(0x42))
        element.perform(Write(0x43))  # the echoes of its last kick still return
        element.apply(Disturb(3e-4))
        element.apply(Read())
        element.advance()
        assert element.progress.phase == 'quieting'
        assert element.idle_ticks == 2  # of three, which the window of the samples lasts
        element.perform(Abort())
        read = element.perform(Read(), between)
        told.append((read.success, read.reading, read.end_tick - read.start_tick, element.ticks))
    assert told[0] == told[1]
    assert told[0][2] > 160  # at rest it takes 158


@pytest.mark.parametrize('state', [-13.9, -7.449, 1.003, 2.376])
def test_element_in_another_ground_state_is_written_again(state):
    """A loud pulse once left an element three ground states below; these are the roots of the
    phase at -2 pi, 0, 4 pi and 6 pi. A wall may leave it at the far end on the way: then the next
    write finds it active.
    """
    element = rig.settle(MemoryElement(NIBBLE), np.full(NIBBLE.design.N, state))
    assert any(element.perform(Write(5)).success for _ in range(2))
    assert element.perform(Read()).reading.level == 5


# --- without a clearing pulse: kicks put walls in and take them out ----------------------------

ROBUST = load_element('robust_words')
ROBUST_CODE = Code(8, 3)


@pytest.mark.parametrize('scatter', [0.0, 0.02])
def test_words_follow_each_other_in_scattered_elements(scatter):
    """Three walls, two of others, one, none: every write takes walls out and puts others in."""
    made = draw_specimen(ROBUST.design, Scatter(alpha=scatter, k_r=scatter, mass=scatter), 77)
    element = rig.shipped('robust_words', made)
    for walls in ((1, 4, 7), (0, 6), (3,), (2, 5)):
        assert element.perform(Write(ROBUST_CODE.word(walls))).success
        assert tuple(levels(element)) == walls
    assert element.perform(Erase()).success
    assert levels(element) == []


def test_erase_of_an_unknown_content_succeeds():
    """A wall pinned by the lattice next to a kink is no word."""
    between = find_pinned_walls(
        Specimen(ROBUST.design), [ROBUST.design.defect_site(level) + 0.3 for level in (2, 4)]
    )
    assert find_wall_levels(ROBUST.design, between) == (2, 4)
    element = rig.settle(MemoryElement(ROBUST), between)
    assert element.perform(Erase()).success
    assert levels(element) == []


def test_kicks_out_have_the_speeds_of_kinks_and_walls_in_turn():
    """Three walls rest: a kink goes to the level below the first, a wall below the second."""
    element, speeds = rig.pin(MemoryElement(ROBUST), 1, 4, 7), []
    drive = element.transducer.drive_end

    def drive_and_record(end, motion):
        if isinstance(motion, KickMotion):
            speeds.append(motion.speed)
        drive(end, motion)

    element.transducer.drive_end = drive_and_record
    assert element.perform(Write(ROBUST_CODE.word((3,)))).success
    of_kinks, of_walls = ROBUST.settings.kick.kink_speeds, ROBUST.settings.kick.wall_speeds
    assert speeds[0] / of_kinks[0] == pytest.approx(speeds[1] / of_walls[3])
    assert speeds[0] < of_kinks[0]  # they stop short of what they are to meet


def test_kicks_clear_only_without_a_clearing_pulse():
    assert [move.name for move in erasing_moves(*ROBUST.design_and_settings)] == ['kick out']
    moves = erasing_moves(*BYTE.design_and_settings)
    assert [move.name for move in moves] == ['clearing pulse']
    assert all(move.start == UNDECODABLE for move in moves)
