# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actuator: never faster than its limit, exactly at its target, unmoved by bad input."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mlmem import Refused
from mlmem.commands import SetStrain
from mlmem.instrument.actuator import Actuator
from mlmem.rejections import ErrorCode
from mlmem.settings import ActuatorSettings

from . import rig

LIMIT, RATE = 0.08, 1e-4
STEP = 0.25
TICK = np.arange(1, 81) * STEP
"""Times of the steps of a tick of 20 time units."""


def actuator():
    return Actuator(ActuatorSettings(max_strain=LIMIT, max_rate=RATE))


def record(moved, ticks=None):
    """Return the strain after every step until the actuator stands still, or for some ticks."""
    trace = []
    while moved.is_moving if ticks is None else len(trace) < ticks:
        trace.append(moved.advance(TICK))
    return np.concatenate(trace)


def rates(start, trace):
    return np.diff(np.concatenate(([start], trace))) / STEP


def test_set_point_is_reached_smoothly_at_rate_limit():
    """A smooth ramp's greatest rate is 1.5 of its mean: 1.5 x 0.05 / 1e-4 = 750 time units."""
    moved = actuator()
    moved.slew_to(0.05)
    trace = record(moved)
    rate = rates(0.0, trace)
    assert rate.max() == pytest.approx(RATE, rel=1e-4)
    assert moved.motion.duration == pytest.approx(750.0)
    # the first step's mean rate, of order (rate of change of rate) x step / 2
    assert rate[0] < 6.0 * 0.05 / 750.0**2 * STEP
    assert moved.strain == 0.05  # exactly
    assert not moved.is_moving
    assert set(record(moved, ticks=5)) == {0.05}
    moved.slew_to(0.05)
    assert not moved.is_moving
    moved.slew_to(-LIMIT)
    record(moved)
    assert moved.strain == -LIMIT


def test_ramp_is_cubic_that_starts_and_ends_at_rest():
    moved = actuator()
    moved.ramp_to(0.048, 1200.0)
    trace = record(moved)
    x = np.arange(1, len(trace) + 1) * STEP / 1200.0
    cubic = np.polynomial.Polynomial([0.0, 0.0, 3.0, -2.0])  # p(0)=p'(0)=p'(1)=0, p(1)=1
    np.testing.assert_allclose(trace, 0.048 * cubic(x), atol=1e-16)
    rate = rates(0.0, trace)
    middle = len(rate) // 2
    assert rate.max() == pytest.approx(1.5 * 0.048 / 1200.0, rel=1e-6)
    assert rate.argmax() in (middle - 1, middle)
    # the first and the last step's mean rate, of order (rate of change of rate) x step / 2
    assert max(rate[0], rate[-1]) < 6.0 * 0.048 / 1200.0**2 * STEP
    assert moved.strain == 0.048


def test_ramp_beyond_rate_limit_takes_longer():
    moved = actuator()
    moved.ramp_to(0.06, 100.0)
    rate = rates(0.0, record(moved))
    assert rate.max() <= RATE * (1 + 1e-9)
    assert rate.max() == pytest.approx(RATE, rel=1e-4)  # and no longer than needed
    assert moved.motion.duration == pytest.approx(900.0)  # 1.5 x 0.06 / 1e-4
    assert moved.strain == 0.06


MOVES = st.tuples(
    st.floats(-LIMIT, LIMIT), st.floats(1.0, 3000.0), st.booleans(), st.integers(0, 60)
)


@rig.unhurried
@given(st.lists(MOVES, min_size=1, max_size=6))
def test_no_sequence_of_moves_exceeds_rate_or_overshoots(moves):
    moved = actuator()
    for target, duration, smooth, ticks in moves:
        start = moved.strain
        if smooth:
            moved.ramp_to(target, duration)
        else:
            moved.slew_to(target)
        for _ in range(ticks):
            before = moved.strain
            trace = moved.advance(TICK)
            # a difference of strains up to 0.08 is rounded to some 1e-17
            assert np.abs(rates(before, trace)).max() <= RATE + 1e-16 / STEP
            assert min(start, target) - 1e-17 <= trace.min()
            assert trace.max() <= max(start, target) + 1e-17
        if not moved.is_moving and ticks:
            assert moved.strain == target


def test_repeated_set_point_goes_on_with_its_move():
    """A loop sends its set-point every period; the move is the one of a single set-point."""
    once, again = actuator(), actuator()
    assert once.slew_to(0.05)
    expected = record(once, ticks=40)
    seen = []
    for tick in range(40):
        assert again.slew_to(0.05) == (tick == 0)
        seen.append(again.advance(TICK))
    np.testing.assert_array_equal(np.concatenate(seen), expected)
    assert again.slew_to(0.04), 'another one is another move'


BAD = [math.nan, math.inf, -math.inf, math.nextafter(LIMIT, 1), -0.081, 10**400]
BAD += ['0.01', None, True]


@pytest.mark.parametrize('strain', BAD, ids=lambda bad: repr(bad)[:12])
@pytest.mark.parametrize('move', ['slew_to', 'ramp_to'])
def test_strain_beyond_limit_is_rejected_whole(strain, move):
    moved = actuator()
    moved.slew_to(0.05)
    record(moved, ticks=3)
    before = dict(vars(moved))
    arguments = (strain,) if move == 'slew_to' else (strain, 1000.0)
    with pytest.raises(Refused) as rejected:
        getattr(moved, move)(*arguments)
    assert (rejected.value.code, rejected.value.field) == (ErrorCode.OUT_OF_RANGE, 'strain')
    assert vars(moved) == before


def test_actuator_strains_material():
    """V_N is the strain times N, its speed at most that of the actuator times N."""
    element = rig.device()
    element.apply(SetStrain(0.01))
    speeds = []
    while element.actuator.is_moving or not speeds:
        element.advance()
        speeds.append(element.substrate_speed)
        stretched = element.chain.V_N
        assert stretched == pytest.approx(element.actuator.strain * rig.DESIGN.N, rel=1e-15)
    assert stretched == pytest.approx(1.25, rel=1e-15)
    assert max(speeds) == pytest.approx(RATE * rig.DESIGN.N, rel=0.02)  # the mean of a tick
    assert len(speeds) == 8  # 1.5 x 0.01 / 1e-4 is 7.5 ticks of 20
    element.advance()
    assert element.substrate_speed == 0.0
