# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many walls in one element: a byte in the paper's second one."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from sampled import sampled

from mlmem_ros.device import (
    UNDECODABLE,
    Abort,
    Calibrate,
    Disturb,
    Erase,
    Faults,
    Locate,
    Read,
    Refused,
    SelfTest,
    SettingsError,
    Write,
    new_element,
    preset,
    snapshot,
)
from mlmem_ros.device.driver import Simulation
from mlmem_ros.device.end import End
from mlmem_ros.device.instrument import Instrument
from mlmem_ros.device.register import Code, forecasts_of, resting
from mlmem_ros.physics import Scatter, Specimen, scattered, walls

BYTE = preset('byte')


@pytest.fixture
def byte():
    """A blank byte."""
    return new_element(BYTE)


def place(element, word):
    """Put walls where those of a word rest; all else is at rest."""
    made = Specimen(element.design)
    element.chain.place(resting(made, element.register.code.walls(word)))
    element.transducer.assume_rest()


def levels(element):
    """Return the levels at which a wall or a kink is, within a cell; None for others."""
    design, found = element.design, []
    for wall in walls(design, element.chain.configuration):
        near = min(range(design.levels), key=lambda n: abs(design.defect(n) - wall.position))
        found.append(near if abs(design.defect(near) - wall.position) < 1.0 else None)
    return sorted(found)


@pytest.mark.parametrize('spacing', [1, 2, 3])
def test_words_are_the_sets_of_levels_that_are_far_enough_apart(spacing):
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


def test_the_levels_of_a_byte_are_its_bits():
    assert Code(8, 1).words == 256
    assert Code(8, 1).walls(0b10100111) == (0, 1, 2, 5, 7)
    assert Code(16, 2).words == 2584  # Fibonacci's 18th number


def test_every_word_rests():
    """All 256 patterns are equilibria whose walls are within two cells of their defects."""
    made = Specimen(BYTE.design)
    for word in range(256):
        resting(made, Code(8, 1).walls(word))


@pytest.mark.parametrize('word', sampled(range(256), lambda word: word in (0, 0x10, 0xA7, 0xFF)))
@pytest.mark.parametrize('amplitude', [0.01, 0.001])
def test_forecasts_are_what_the_kernel_does(word, amplitude):
    """Small waves, beside the simulated ends of an element with scattered cells: within 0.4 % of
    the pulse, and 0.08 % with a tenth of its amplitude, where walls are linear.
    """
    register = replace(BYTE.settings.register, A=amplitude)
    settings = replace(BYTE.settings, register=register)
    scatter = Scatter(alpha=1e-3, k_r=1e-3, mass=1e-3, offset=1e-3)
    made = scattered(BYTE.design, scatter, 3)
    found = forecasts_of(made, settings)
    twin = Instrument(BYTE.design, settings, Simulation.of(made, settings.time))
    twin.chain.place(resting(made, found.code.walls(word)))
    twin.transducer.assume_rest()
    recorder = twin.transducer.shoot(End.LEFT, register.probe)
    twin.pass_ticks(found.listener.ticks)
    shot = recorder.shot(0.0, 0.0, twin.driver.dt)
    heard = found.listener.part(shot.samples - shot.rest[:, None], shot.dt)
    off = np.linalg.norm(found.parts[word] - heard) / np.linalg.norm(heard)
    assert off < (0.004 if amplitude == 0.01 else 8e-4)


def test_no_two_words_are_nearer_than_found():
    """`nearest` compares in single precision, half of the words at a time."""
    found = forecasts_of(Specimen(BYTE.design), BYTE.settings)
    apart = np.linalg.norm(found.parts[:, None] - found.parts, axis=2)
    odd = np.array([word.bit_count() % 2 for word in range(256)])
    apart[(odd[:, None] != odd) | np.eye(256, dtype=bool)] = np.inf
    assert found.nearest == pytest.approx(apart.min(axis=1), rel=1e-4)


def test_words_are_written_verified_and_read(byte):
    """0x10 is one wall, 0xff eight, 0xa7 mixed; from each to the next, with no strain."""
    assert byte.words == 256
    for word in (0x10, 0xA7, 0xFF, 0x00, 0x5A, 0x5B):
        written = byte.perform(Write(word))
        assert written.success, written.error
        assert levels(byte) == [n for n in range(8) if word >> n & 1]
        read = byte.perform(Read())
        assert read.success, read.error
        assert (read.reading.level, read.reading.code) == (word, f'{word:08b}')
        assert read.reading.walls == word.bit_count()
    assert byte.actuator.strain == 0.0
    assert byte.transmission.encoder == 0.0


def test_what_is_right_of_the_change_stays(byte):
    """From 0xa0 to 0xa4 one kick is enough: a third of the time, and no loud pulse."""
    first = byte.perform(Write(0xA0))
    second = byte.perform(Write(0xA4))
    assert second.success, second.error
    assert second.end_tick - second.start_tick < 0.7 * (first.end_tick - first.start_tick)


def test_an_erased_byte_reads_0(byte):
    place(byte, 0b1101_0110)
    erased = byte.perform(Erase())
    assert erased.success, erased.error
    assert levels(byte) == []
    assert byte.perform(Read()).reading.level == 0


def test_locate_names_kind_and_cell_of_every_wall(byte):
    place(byte, 0b1000_0101)
    found = byte.perform(Locate()).found
    assert found == {'walls': 3, 'cells': '25 75 200', 'kinds': 'wall kink wall'}


def test_self_test_and_calibration_go_through_all_levels(byte):
    place(byte, 0x81)
    tested = byte.perform(SelfTest())
    assert tested.success, tested.error
    assert [check.name for check in tested.checks if 'level' in check.name] == [
        f'level {n}' for n in range(8)
    ]
    assert tested.reading.level == 0x81
    calibrated = byte.perform(Calibrate())
    assert (calibrated.success, calibrated.reading.level) == (True, 0x81)


def test_a_word_beyond_the_last_is_refused(byte):
    with pytest.raises(Refused, match='level must be a whole number from 0 to 255; got 256'):
        byte.apply(Write(256))


def test_the_content_survives_in_a_snapshot(byte):
    byte.perform(Write(0xC3))
    other = new_element(BYTE)
    snapshot.restore(other, snapshot.take(byte))
    assert other.reading.level == 0xC3
    assert other.perform(Read()).reading.level == 0xC3


def wrong(byte, faults, rng, count):
    """Read random words with faults; return how many are right, and all that are wrong."""
    right, found = 0, []
    for _ in range(count):
        word, given = int(rng.integers(256)), faults(rng)
        byte.set_faults(Faults())
        place(byte, word)
        byte.set_faults(given)
        read = byte.perform(Read())
        byte.transducer.release()
        right += read.success and read.reading.level == word
        if read.success and read.reading.level != word:
            found.append((word, read.reading.level, given))
    return right, found


def anywhere(rng):
    return int(rng.integers(2, BYTE.design.N))


COUNTS = sampled([5, 20], lambda count: count == 5)


@pytest.mark.parametrize('count', COUNTS)
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
def test_no_fault_has_a_word_read_as_another(byte, faults, share, count):
    """What disorder of a thousandth and a thousandth of the pulse in noise leave is read, too."""
    right, found = wrong(byte, faults, np.random.default_rng(5), count)
    assert found == []
    assert right >= share * count


@pytest.mark.parametrize('end', list(End), ids=str)
@pytest.mark.parametrize('late', [1.0, 7.0, 23.0, 56.0])
@pytest.mark.parametrize('count', COUNTS)
def test_a_late_end_changes_no_word(byte, end, late, count, monkeypatch):
    """What an end hears comes later by up to the way to the next level and back, 56 units."""
    decode = type(byte.register).decode

    def delayed(self, shots, *rest):
        (shot,) = shots
        samples, n = shot.samples.copy(), round(late / shot.dt)
        samples[end.row] = np.concatenate((np.full(n, shot.rest[end.row]), samples[end.row, :-n]))
        return decode(self, [replace(shot, samples=samples)], *rest)

    monkeypatch.setattr(type(byte.register), 'decode', delayed)
    right, found = wrong(byte, lambda rng: Faults(), np.random.default_rng(2), count)
    assert found == []
    assert right == 0


def test_a_shaken_element_is_not_read(byte):
    """Harmless to the content, but louder than the difference of two words."""
    place(byte, 0x42)
    rng = np.random.default_rng(1)
    read = byte.perform(Read(), between=lambda: byte.base.disturb(rng.uniform(-1e-4, 1e-4)))
    assert (read.success, read.reading.level) == (False, UNDECODABLE)
    assert levels(byte) == [1, 6]


def test_an_element_that_rings_is_heard_at_one_tick_however_often_it_is_looked_at():
    """While the ends are to become quiet ticks are deferred; every tick is judged nevertheless."""
    told = []
    for between in (None, lambda: None):
        byte = new_element(BYTE)
        byte.perform(Write(0x42))
        byte.perform(Write(0x43))  # its last kick is still heard
        byte.apply(Disturb(3e-4))
        byte.apply(Read())
        byte.advance()
        assert byte.progress.phase == 'quieting'
        assert byte.idle_ticks == 2  # of three, as long as the window of what is heard
        byte.perform(Abort())
        read = byte.perform(Read(), between)
        told.append((read.success, read.reading, read.end_tick - read.start_tick, byte.ticks))
    assert told[0] == told[1]
    assert told[0][2] > 160  # at rest it takes 158


@pytest.mark.parametrize(
    ('kick', 'text'),
    [
        ({'speeds': '0.1 0.2'}, "a kick to each of its 8 levels.*got kick.speeds '0.1 0.2'"),
        ({'kinks': '0 0.1 0.1 0.1 0.1 0.1 0.1 0.1'}, 'a kick to each of its 8 levels'),
        ({'kinks': '0.1 fast'}, "kinks must be 0 or from 1e-4 to 10.*got '0.1 fast'"),
        ({'kinks': 'nan'}, 'kinks must be 0 or from'),
    ],
)
def test_settings_of_a_register_are_checked(kick, text):
    with pytest.raises(SettingsError, match=text):
        new_element(BYTE.design, replace(BYTE.settings, kick=replace(BYTE.settings.kick, **kick)))


def test_a_setting_at_its_default_changes_no_digest():
    """So that a new setting leaves the digests of saved parameters as they are."""
    case_2 = preset('case_2')
    assert BYTE.digest != case_2.digest
    kick = replace(case_2.settings.kick, hold=21.0)
    assert case_2._replace(settings=replace(case_2.settings, kick=kick)).digest != case_2.digest


@pytest.mark.parametrize('state', [-13.9, -7.449, 1.003, 2.376])
def test_an_element_that_lies_in_another_ground_state_is_written_again(state):
    """A loud pulse once left a register three ground states below; these are the roots of the
    phase at -2 pi, 0, 4 pi and 6 pi. A wall may leave it at the far end on the way: then the next
    write finds it active.
    """
    element = new_element(preset('register_4'))
    element.chain.place(np.full(element.design.N, state))
    element.transducer.assume_rest()
    assert any(element.perform(Write(5)).success for _ in range(2))
    assert element.perform(Read()).reading.level == 5
