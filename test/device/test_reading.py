# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading: echoes in synthetic signals, against a plain convolution and a plain search; and what
they are decoded as: a level, blank, or undecodable with a reason, never a guess.

The carrier filter: each end detects its own pulse, not that of the other end, nothing slower.
"""

import dataclasses
import math
import re

import numpy as np
import pytest
import rig
from hypothesis import given, settings
from hypothesis import strategies as st

from mlmem import (
    BLANK,
    ELEMENT_NAMES,
    UNDECODABLE,
    Calibration,
    DelayTable,
    factory_calibration,
    load_element,
)
from mlmem.instrument.echo import (
    ECHO_TAIL_TIME,
    MIN_THRESHOLD_CELLS,
    Echo,
    EchoDetector,
    compute_weights,
    detection_threshold,
    filter_carrier,
)
from mlmem.instrument.end import End
from mlmem.physics import CASE_II
from mlmem.readers.decoding import Decoder, find_exchanged_levels
from mlmem.settings import ProbeSettings, ReadSettings, Settings

DT = 0.25
PROBE = ProbeSettings()
"""omega_c = 2.1, so T = 23.936; sigma = 8, so the pulse ends at 96."""


def times(n):
    return np.arange(1, n + 1) * DT


def convolved(v):
    """Return |v| convolved with a centred box of width 16 pi / 2.1, zero before the start.

    Only where the box has all its samples.
    """
    half = round(8 * np.pi / 2.1 / DT)
    box = np.ones(2 * half + 1) / (2 * half + 1)
    return np.convolve(np.abs(v), box, mode='same')[: len(v) - half]


def heard(v, chunks=(80,)):
    """Feed a signal in chunks of the given sizes, over and over."""
    detector = EchoDetector(PROBE, DT, filtered=False)
    start = 0
    while start < len(v):
        for size in chunks:
            detector.feed_displacements(v[start : start + size])
            start += size
    return detector


@settings(rig.unhurried, max_examples=25)
@given(
    st.lists(st.integers(1, 300), min_size=1, max_size=5),
    st.lists(st.floats(0.0, 600.0), max_size=6),
    st.integers(0, 2**32 - 1),
)
def test_delay_is_first_crossing_for_any_cut_of_samples(chunks, arrivals, seed):
    """Among many echoes and noise; v_c is a centred convolution. It is compared with the threshold
    after the pulse and half a box.
    """
    t, v = times(2600), np.random.default_rng(seed).normal(0.0, 5e-5, 2600)
    for at in arrivals:
        v += 5e-4 * np.exp(-0.5 * ((t - at) / 8.0) ** 2) * np.sin(2.1 * t)
    detector = heard(v, chunks)
    v_c, t = convolved(v), times(len(v) - 48)
    looked = t > 96.0 + 8 * np.pi / 2.1
    ratio = v_c / (1.6e-4 * np.exp(-0.002 * t))
    crossings = t[looked & (ratio > 1.0)]
    assert detector.delay == (crossings[0] if len(crossings) else None)
    assert detector.threshold_margin == pytest.approx(ratio[looked].max(), rel=1e-12)
    echo = detector.build_echo(End.LEFT)
    np.testing.assert_array_equal(echo.t, t)
    np.testing.assert_array_equal(echo.v_m, np.abs(v)[: len(t)])
    # sums of 2600 samples of 5e-5 to 5e-4 are rounded to 1e-16, the means of 97 to less
    np.testing.assert_allclose(echo.v_c, v_c, atol=1e-16)


def test_no_echo_is_detected_while_window_overlaps_pulse():
    """However loud the pulse; a signal right after it is detected at once."""
    v = np.zeros(2000)
    v[times(2000) < 96.0] = 1e6
    detector = heard(v)
    assert detector.delay is None
    assert detector.threshold_margin == 0.0
    assert detector.build_echo(End.LEFT).shape == (None, None, 0.0)
    assert detector.build_echo(End.LEFT).measure_amplitude(math.inf) == 0.0
    v[times(2000) > 96.0] = 1.0
    assert heard(v).delay == 108.0  # the first sample after 96 + T / 2 = 107.968


@pytest.mark.parametrize('gain_decay', [0.02, 1.0])
def test_threshold_never_falls_below_rounding(gain_decay):
    """However fast it decays and however long the detector listens, rounding is no echo."""
    probe = dataclasses.replace(PROBE, gain_decay=gain_decay)
    detector = EchoDetector(probe, 0.25)
    detector.feed_displacements(1e-15 * np.random.default_rng(1).standard_normal(40_000))
    echo = detector.build_echo(End.LEFT)
    assert echo.delay is None
    assert echo.threshold_margin < 1.0
    assert detection_threshold(probe, np.array(1e9)) == MIN_THRESHOLD_CELLS
    assert dataclasses.replace(echo, floor=1e-9).threshold_factor < 1e5


PROBES = {end: end.select_probe(Settings()) for end in End}
"""Case II's carriers: 2.1 at the left, 0.7 at the right."""

STEPS = (0.25, 0.5)
"""Samples of the paper's method and of the fourth-order one."""


def passes(end, dt, omega):
    """Return the amplitude that is left of a wave of amplitude 1, whatever its phase."""
    t = np.arange(6000) * dt
    parts = [
        filter_carrier(wave(omega * t), compute_weights(PROBES[end], dt))
        for wave in (np.sin, np.cos)
    ]
    amplitudes = np.hypot(*parts)
    assert np.ptp(amplitudes) < 1e-9, 'every part of a wave passes alike'
    return amplitudes.mean()


@pytest.mark.parametrize('end', list(End))
@pytest.mark.parametrize('dt', STEPS)
def test_carrier_passes_unchanged_and_in_phase(end, dt):
    """Too few samples give nothing."""
    kernel = compute_weights(PROBES[end], dt)
    for samples, passed in ((0, 0), (3, 0), (len(kernel) - 1, 0), (len(kernel), 1)):
        assert filter_carrier(np.ones(samples), kernel).shape == (passed,)
    n = len(kernel) // 2
    wave = np.sin(PROBES[end].omega_c * np.arange(2000) * dt + 0.4)
    np.testing.assert_allclose(filter_carrier(wave, kernel), wave[n:-n], atol=1e-13)


@pytest.mark.parametrize('end', list(End))
@pytest.mark.parametrize('share', [0.8, 0.9, 1.1, 1.25])
def test_band_is_gaussian_about_carrier(end, share):
    expected = math.exp(-0.5 * (2.0 * math.pi * (share - 1.0)) ** 2)
    got = passes(end, 0.25, share * PROBES[end].omega_c)
    assert got == pytest.approx(expected, abs=2e-3)  # what was subtracted, so that 0 is removed


@pytest.mark.parametrize(
    ('end', 'dt', 'omega', 'most'),
    [
        *((end, dt, 0.0, 1e-13) for end in End for dt in STEPS),  # a strained end stands still
        (End.LEFT, 0.25, 0.7, 2e-4),  # the carrier of the right end
        (End.LEFT, 0.5, 0.7, 2e-4),
        (End.RIGHT, 0.25, 2.1, 2e-5),  # and of the left one
        (End.RIGHT, 0.5, 2.1, 2e-5),
        (End.LEFT, 0.25, 0.47, 2e-4),  # all cells in phase after a strain
        (End.LEFT, 0.25, 0.21, 1e-4),  # a shaken base
        (End.RIGHT, 0.25, 0.07, 1e-4),
    ],
)
def test_waves_far_from_carrier_do_not_pass(end, dt, omega, most):
    """The weights, which end at four standard deviations, let some 1e-4 of any wave pass."""
    assert passes(end, dt, omega) < most


CALIBRATION = Calibration(
    DelayTable(tuple(200.0 + 100.0 * level for level in range(8))),
    DelayTable(tuple(630.0 - 70.0 * level for level in range(8)), blank=780.0),
)
"""Nearly those of Case II: levels are 110 apart at the left, and 67 at the right."""

STORED, EMPTY = (1, 0), (0, 0)
"""Phases of the left and right end with a wall between them, and of a blank element."""


def echo(delay, end=End.LEFT, margin=3.0, **values):
    t = np.zeros(0) if delay is None else np.array([delay])
    v_c = margin * detection_threshold(PROBES[end], t, values.get('floor', 0.0))
    return Echo(end, PROBES[end], t, v_c, v_c, delay, margin, **values)


def decoded(delay, end=End.LEFT, phases=STORED, calibration=CALIBRATION, **settings):
    """Decode an echo at one end alone."""
    decoder = Decoder(CASE_II, ReadSettings(**settings), calibration)
    return decoder.decode({end: echo(delay, end)}, phases)


def both(left, right, names='left', calibration=CALIBRATION, **settings):
    """Decode echoes at both ends, given as delays or as they are."""
    echoes = {
        each: given if isinstance(given, Echo) else echo(given, each)
        for each, given in zip(End, (left, right), strict=True)
    }
    decoder = Decoder(CASE_II, ReadSettings(end=names, **settings), calibration)
    return decoder.decode(echoes, STORED)


@pytest.mark.parametrize(
    ('delay', 'least', 'level', 'margin', 'distance'),
    [
        (300.0, 0.2, 1, 1.0, 49.0),
        (220.0, 0.2, 0, 0.6, 29.0),
        (339.0, 0.2, 1, 0.22, 58.75),
        (170.0, 0.2, 0, 0.4, 24.0),
        (241.0, 0.15, 0, 0.18, 34.25),
        (274.0, 0.5, UNDECODABLE, 0.0, math.inf),  # at 26 of 100 the margin is 0.48
        (226.0, 0.5, UNDECODABLE, 0.0, math.inf),
        (174.0, 0.5, UNDECODABLE, 0.0, math.inf),
        (926.0, 0.5, UNDECODABLE, 0.0, math.inf),
    ],
)
def test_delay_near_level_is_that_level_with_margin(delay, least, level, margin, distance):
    """25 cells are 100 time units here, so the distance goes with the delay: 24 + 0.25 x 20."""
    reading = decoded(delay, min_margin=least)
    assert (reading.level, reading.delay) == (level, delay)
    assert reading.level_margin == pytest.approx(margin)
    assert reading.distance == pytest.approx(distance)
    assert ('lies between levels' in reading.reason) == (level == UNDECODABLE)


def test_phase_of_left_end_distinguishes_equal_echoes():
    """Blank and level 0 are the farthest from the right: no wall is blank, no kink at level 0."""
    right = dataclasses.replace(CALIBRATION.right, blank=633.0)
    alike = dataclasses.replace(CALIBRATION, right=right)
    for delay in (628.0, 632.0, 634.0):
        assert decoded(delay, End.RIGHT, STORED, alike).level == 0
        assert decoded(delay, End.RIGHT, EMPTY, alike).level == BLANK


@pytest.mark.parametrize(
    ('delay', 'end', 'phases', 'reason'),
    [
        (None, End.LEFT, STORED, 'no echo came back'),
        (None, End.RIGHT, EMPTY, 'no echo came back'),
        (1100.0, End.LEFT, (1, 1), 'the right end is active: the wall has left the element'),
        (400.0, End.LEFT, (1, 1), 'the left one hears a wall at level 2: there are two walls'),
        (None, End.RIGHT, (0, 1), 'the right end is active: the wall has left the element'),
        (400.0, End.LEFT, (None, 0), 'the left end rests in neither phase'),
        (400.0, End.LEFT, (1, None), 'the right end rests in neither phase'),
        (400.0, End.LEFT, EMPTY, 'the left end is inactive and hears nothing: probe the right'),
        (420.0, End.RIGHT, EMPTY, 'the left end is inactive, but .* is that of a wall at level 3'),
        (780.0, End.RIGHT, STORED, 'the delay 780.00 at the right end lies between levels'),
    ],
)
def test_inconsistent_observations_are_undecodable(delay, end, phases, reason):
    reading = decoded(delay, end, phases)
    assert reading.level == UNDECODABLE
    assert reading.level_margin == 0.0
    assert reading.distance == math.inf
    assert re.search(reason, reading.reason)


@pytest.mark.parametrize(('left', 'right'), [(2.5, 3.0), (3.0, 2.5)])
def test_reading_has_the_lesser_margins_of_both_ends(left, right):
    """10 of 50 off at the left, and 14 of 35 at the right."""
    reading = both(echo(510.0, margin=left), echo(434.0, End.RIGHT, margin=right))
    assert reading.level == 3
    assert reading.level_margin == pytest.approx(0.6)
    assert (reading.threshold_margin, reading.confidence) == (2.5, pytest.approx(0.6))


@pytest.mark.parametrize(
    ('left', 'right', 'level', 'walls', 'reason'),
    [
        (500.0, 437.0, 3, 1, ''),  # 17 of 35 off
        (500.0, 403.0, 3, 1, ''),
        (500.0, 438.0, UNDECODABLE, None, ''),  # 18: both must confirm with the least margin
        (500.0, 402.0, UNDECODABLE, None, ''),
        (500.0, 520.0, UNDECODABLE, None, ''),
        (300.0, 280.0, UNDECODABLE, 3, ''),  # at 50 and 150 of 225: in order, so three walls
        (600.0, 420.0, UNDECODABLE, None, ''),  # the first from the left is beyond the other
        (None, 420.0, UNDECODABLE, None, 'no echo came back'),
        (500.0, None, UNDECODABLE, None, 'level 3 is not confirmed: no echo came back'),
        (550.0, 420.0, UNDECODABLE, None, 'lies between levels'),
    ],
)
def test_ends_that_disagree_name_no_level(left, right, level, walls, reason):
    reading = both(left, right)
    assert (reading.level, reading.walls) == (level, walls)
    assert (reading.left_delay, reading.right_delay) == (left, right)
    assert bool(reading.code) == bool(level >= 0)
    assert math.isinf(reading.distance) == (level == UNDECODABLE)
    assert reason in reading.reason


def test_levels_near_other_end_may_share_delay():
    """As in elements with nine cells between levels: 3 apart at one end, 70 at the other.

    A delay there is compared with the spacing about the level, 100, and must also be nearer to its
    own than to the other: by 0.1 of 3, so within 1.35 of its own.
    """
    left = DelayTable((200.0, 203.0, *(300.0 + 100.0 * n for n in range(6))))
    near = dataclasses.replace(CALIBRATION, left=left)
    for level, heard in ((0, 190.0), (0, 201.1), (1, 201.9), (1, 213.0)):
        reading = both(heard, 630.0 - 70.0 * level, 'right', near)
        assert reading.level == level
        assert reading.level_margin > 0.7
        assert both(heard, 630.0 - 70.0 * (1 - level), 'right', near).level == UNDECODABLE
    for level in (0, 1):
        unclear = both(201.5, 630.0 - 70.0 * level, 'right', near)
        assert unclear.level == UNDECODABLE
        assert f'the left end does not tell it from level {1 - level}' in unclear.reason
    assert both(400.0, 630.0 - 70.0 * 3 - 10.0, 'right', near).level == 3


def bumps(early, late):
    """An echo in two bumps, at 400 and 500, of heights in thresholds; they are 2 wide."""
    t = np.arange(1.0, 1000.0)
    height = np.where(np.abs(t - 400.0) < 2.0, early, np.where(np.abs(t - 500.0) < 2.0, late, 0.0))
    v_c = height * detection_threshold(PROBES[End.LEFT], t)
    delay = float(t[np.argmax(height > 1.0)])
    return dataclasses.replace(echo(delay), t=t, v_m=v_c, v_c=v_c)


@pytest.mark.parametrize(
    ('early', 'late', 'levels'),
    [
        (0.5, 2.0, {3}),
        (0.9, 2.0, {3}),
        (1.1, 2.0, set()),  # half-way: two crossings are those of 2, and two those of 3
        (1.5, 2.0, {2}),
    ],
)
def test_bump_near_threshold_confirms_with_it_or_without(early, late, levels):
    """Level 2 has one bump at 400; level 3 one of 0.9 thresholds there, and then one at 500.

    Of the crossings of 0.8, 1 and 1.25 thresholds two must agree.
    """
    shapes = [(delay, delay, 3.0) for delay in CALIBRATION.left.delays]
    shapes[3] = (400.0, 500.0, 3.0)
    bumpy = dataclasses.replace(CALIBRATION.left, shapes=tuple(shapes))
    calibration = dataclasses.replace(CALIBRATION, left=bumpy)
    heard = bumps(early, late)
    confirmed = {
        level
        for level in (2, 3)
        if both(heard, 630.0 - 70.0 * level, 'right', calibration).level >= 0
    }
    assert confirmed == levels


@pytest.mark.parametrize('end', list(End))
def test_echo_much_louder_than_calibrated_names_no_level(end):
    """The echoes of the tests are 3 thresholds loud; noise makes any louder."""
    table = CALIBRATION.table(end)
    for loud, floor, level in ((2.5, 0.0, 3), (2.3, 0.0, UNDECODABLE), (2.3, 1e-6, 3)):
        known = dataclasses.replace(table, shapes=((None, None, loud),) * 8)
        calibration = dataclasses.replace(CALIBRATION, **{end.value: known})
        reading = both(
            echo(500.0, floor=floor), echo(420.0, End.RIGHT, floor=floor), 'left', calibration
        )
        assert reading.level == level
        told = f'the {end} end hears an echo 1.30 times as loud as that of level 3'
        assert (told in reading.reason) == (level == UNDECODABLE)


def test_late_echo_is_not_louder_for_longer_listening():
    """It grows to 3 thresholds, but to 2 until the end of what the calibration heard."""
    t, known = np.array([510.0, 640.0, 655.0]), ((None, None, 2.0),) * 8
    v_c = np.array([1.1, 2.0, 3.0]) * detection_threshold(PROBES[End.LEFT], t)
    late = dataclasses.replace(echo(510.0), t=t, v_c=v_c)
    assert late.measure_amplitude(500.0 + ECHO_TAIL_TIME) == pytest.approx(2.0)
    table = dataclasses.replace(CALIBRATION.left, shapes=known)
    right = echo(420.0, End.RIGHT)
    right = dataclasses.replace(right, t=np.append(right.t, t[-1]), v_c=np.repeat(right.v_c, 2))
    reading = both(late, right, calibration=dataclasses.replace(CALIBRATION, left=table))
    assert (reading.level, reading.reason) == (3, '')


@pytest.mark.parametrize('end', list(End))
@pytest.mark.parametrize(
    ('values', 'reason'),
    [
        ({'floor': 1e-3}, 'hides when the echo began'),
        ({'spoiled': True, 'shaken': True}, 'the base began to shake while the {} end listened'),
    ],
)
def test_doubtful_echo_at_either_end_is_undecodable(end, values, reason):
    """A floor of 1e-3 raises both thresholds, 1.6e-4 and 7e-4, more than 1.4 times."""
    heard = [
        echo(delay, each, **(values if each is end else {}))
        for each, delay in zip(End, (500.0, 420.0), strict=True)
    ]
    reading = both(*heard)
    assert reading.level == UNDECODABLE
    assert reason.format(end) in reading.reason


def test_shaken_echo_needs_more_margin():
    """15 of 50 off is a margin of 0.7, less than 0.8."""
    shaken = echo(515.0, shaken=True), echo(420.0, End.RIGHT, shaken=True)
    assert both(*shaken, shaken_margin=0.8).level == UNDECODABLE
    assert both(*shaken, shaken_margin=0.6).level == 3
    assert both(515.0, 420.0, shaken_margin=0.8).level == 3


@pytest.mark.parametrize(
    'name', [name for name in ELEMENT_NAMES if load_element(name).settings.read.method == 'delay']
)
def test_no_calibration_that_ships_lets_one_end_change_level(name):
    design, settings = load_element(name).design_and_settings
    assert find_exchanged_levels(design, settings, factory_calibration(design, settings)) == []


@rig.unhurried
@given(
    st.lists(st.integers(1, 60), min_size=2, max_size=6),
    st.lists(st.integers(1, 60), min_size=2, max_size=6),
    st.floats(0.0, 0.9),
)
def test_no_table_at_all_lets_one_end_change_level(left, right, margin):
    """Levels may be as near each other, and as unevenly spaced, as they like."""
    n = min(len(left), len(right))
    one = DelayTable(tuple(130.0 + float(sum(left[:k])) for k in range(n)))
    other = DelayTable(tuple(900.0 - float(sum(right[:k])) for k in range(n)))
    settings = rig.change(load_element('case_2').settings, read={'min_margin': margin})
    design = dataclasses.replace(CASE_II, N=25 * (n + 1))
    assert find_exchanged_levels(design, settings, Calibration(one, other)) == []


@pytest.mark.parametrize(
    ('level_margin', 'threshold_margin', 'confidence'),
    [
        (1.0, 4.0, 0.75),  # three quarters of the echo may be lost
        (0.3, 4.0, 0.3),  # the delay may shift by 0.3 of the way to half-way
        (1.0, 2.0, 0.5),
        (1.0, 1.0, 0.0),
        (0.9, 0.5, 0.0),
        (-0.1, 4.0, 0.0),
    ],
)
def test_confidence_is_loss_that_changes_no_answer(level_margin, threshold_margin, confidence):
    margins = {'level_margin': level_margin, 'threshold_margin': threshold_margin}
    reading = dataclasses.replace(decoded(500.0), **margins)
    assert reading.confidence == pytest.approx(confidence)
    assert dataclasses.replace(reading, level=UNDECODABLE).confidence == 0.0


def test_crossing_when_listening_begins_is_only_a_near_level():
    """The window is clear of the pulse at 108.0; a level is that near only by its own delay, and
    what is heard then confirms no other.
    """
    assert 'and no level is so near' in decoded(108.5, min_margin=0.0).reason
    near = dataclasses.replace(CALIBRATION, left=DelayTable((108.5, *range(300, 1000, 100))))
    assert decoded(108.5, calibration=near).level == 0
    assert decoded(108.0, calibration=near).level == UNDECODABLE
    assert both(108.0, 630.0, 'right', near).level == 0
    assert both(108.0, 560.0, 'right', near).level == UNDECODABLE
    assert both(108.0, 630.0, 'right').level == UNDECODABLE
