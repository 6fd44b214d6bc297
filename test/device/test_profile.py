# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Timed strain profiles: through their points, within both limits, or refused."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from mlmem import FollowTrajectory, Refused, SetStrain
from mlmem.instrument.actuator import MAX_PROFILE_POINTS, plan_profile
from mlmem.rejections import ErrorCode
from mlmem.settings import ActuatorSettings, ScaleSettings

from . import rig

LIMITS = ActuatorSettings(max_strain=0.08, max_rate=1e-4)
UNIT = ScaleSettings().time
"""1e-4 s, so that the rate limit is 1/s and a tick of 20 time units 2 ms."""

WAVE = FollowTrajectory((0.1, 0.2, 0.4), (0.05, -0.01, 0.0), (0.0, -0.5, 0.0))


def followed(command, ticks=None):
    """Return the strain after every tick of a device that follows a trajectory to its end."""
    element = rig.device()
    element.apply(command)
    trace = []
    while element.actuator.is_moving if ticks is None else len(trace) < ticks:
        element.advance()
        trace.append(element.actuator.strain)
    return np.array(trace)


def test_profile_without_rates_is_lines_between_its_points():
    trace = followed(FollowTrajectory(WAVE.times, WAVE.strains))
    t = 0.002 * np.arange(1, len(trace) + 1)
    lines = np.interp(t, [0.0, *WAVE.times], [0.0, *WAVE.strains])
    np.testing.assert_allclose(trace, lines, atol=1e-16)
    assert len(trace) == 200  # 0.4 s in ticks of 2 ms
    assert trace[-1] == 0.0  # exactly
    limit = followed(FollowTrajectory((0.08, 0.16), (0.08, 0.0)))  # 1/s up to 0.08
    assert limit.max() == 0.08


def test_profile_with_rates_is_cubics_between_its_points():
    trace = followed(WAVE)
    t = 0.002 * np.arange(1, len(trace) + 1)
    spline = CubicHermiteSpline([0.0, *WAVE.times], [0.0, *WAVE.strains], [0.0, *WAVE.rates])
    np.testing.assert_allclose(trace, spline(t), atol=1e-16)


def test_profile_starts_from_present_strain():
    element = rig.device()
    element.apply(SetStrain(0.01))
    rig.ticks(element, 8)
    assert element.actuator.strain == 0.01
    element.apply(FollowTrajectory((0.0, 0.1), (0.01, 0.03)))
    rig.ticks(element, 25)
    assert element.actuator.strain == pytest.approx(0.02, abs=1e-16)  # half-way
    element.apply(FollowTrajectory((0.1,), (0.0,)))  # which takes the place of the first
    rig.ticks(element, 25)
    assert element.actuator.strain == pytest.approx(0.01, abs=1e-16)
    element.apply(SetStrain(0.02))  # as a set-point does
    rig.ticks(element, 8)
    assert element.actuator.strain == 0.02
    assert not element.actuator.is_moving


POINTS = st.lists(
    st.tuples(st.floats(0.01, 0.5), st.floats(-0.08, 0.08), st.floats(-1.0, 1.0)),
    min_size=1,
    max_size=5,
)


@rig.unhurried
@given(POINTS, st.booleans())
def test_exactly_profiles_within_both_limits_are_taken(points, with_rates):
    waits, strains, rates = zip(*points, strict=True)
    times = tuple(np.cumsum(waits).tolist())
    command = FollowTrajectory(times, strains, rates if with_rates else ())
    t = np.linspace(0.0, times[-1], 20_001)
    if with_rates:
        oracle = CubicHermiteSpline([0.0, *times], [0.0, *strains], [0.0, *rates])(t)
    else:
        oracle = np.interp(t, [0.0, *times], [0.0, *strains])
    # the sampled rate misses its peak by the curvature over a step
    over = max(np.abs(oracle).max() / 0.08, np.abs(np.diff(oracle) / np.diff(t)).max())
    assume(abs(over - 1.0) > 1e-3)
    if over > 1.0:
        with pytest.raises(Refused, match=r'must stay within .* \(actuator\.max_'):
            plan_profile(command, 0.0, LIMITS, UNIT)
    else:
        np.testing.assert_allclose(
            plan_profile(command, 0.0, LIMITS, UNIT).strain(t / UNIT), oracle, atol=1e-14
        )


def test_cubic_is_judged_only_within_its_segment():
    """It would go on to 0.109 at 1.6 times its width, and is 0.075 at its end."""
    rising = plan_profile(FollowTrajectory((0.12,), (0.075,), (0.8,)), 0.0, LIMITS, UNIT)
    strains, rates = rising.find_extremes()
    assert strains == pytest.approx([0.075])
    assert rates * 1e4 == pytest.approx([0.856], abs=1e-3)  # at 0.8 of its width


BAD = [
    (FollowTrajectory((0.1,), (0.01,), joint='elbow'), ErrorCode.OUT_OF_RANGE, 'joint'),
    (FollowTrajectory((), ()), ErrorCode.OUT_OF_RANGE, 'times'),
    (FollowTrajectory((0.1, 0.2), (0.01,)), ErrorCode.CONFLICT, 'strains'),
    (FollowTrajectory((0.1, 0.2), (0.01, 0.0), (0.0,)), ErrorCode.CONFLICT, 'rates'),
    (FollowTrajectory((0.2, 0.1), (0.01, 0.0)), ErrorCode.CONFLICT, 'times'),
    (FollowTrajectory((0.1, 0.1), (0.01, 0.01)), ErrorCode.CONFLICT, 'times'),
    (FollowTrajectory((-0.1, 0.1), (0.0, 0.01)), ErrorCode.CONFLICT, 'times'),
    (FollowTrajectory((0.0,), (0.0,)), ErrorCode.OUT_OF_RANGE, 'times'),
    (FollowTrajectory((0.0, 0.1), (0.01, 0.01)), ErrorCode.CONFLICT, 'strains'),
    (FollowTrajectory((0.1,), (math.nan,)), ErrorCode.OUT_OF_RANGE, 'strains'),
    (FollowTrajectory((math.inf,), (0.01,)), ErrorCode.OUT_OF_RANGE, 'times'),
    (FollowTrajectory((0.1,), (0.01,), (math.nan,)), ErrorCode.OUT_OF_RANGE, 'rates'),
    (FollowTrajectory((0.1,), ('0.01',)), ErrorCode.OUT_OF_RANGE, 'strains'),
    (FollowTrajectory((0.1,), (10**400,)), ErrorCode.OUT_OF_RANGE, 'strains'),
    (FollowTrajectory((0.1, 0.3), (0.05, 0.0801)), ErrorCode.OUT_OF_RANGE, 'strains'),
    (FollowTrajectory((0.1, 0.11), (0.01, 0.021)), ErrorCode.OUT_OF_RANGE, 'rates'),
    # It bulges between its points.
    (FollowTrajectory((0.1, 0.2), (0.075, 0.075), (0.0, -0.9)), ErrorCode.OUT_OF_RANGE, 'strains'),
    (FollowTrajectory((0.1,), (0.08,), (0.0,)), ErrorCode.OUT_OF_RANGE, 'rates'),
    (FollowTrajectory((5e-324,), (0.01,)), ErrorCode.OUT_OF_RANGE, 'rates'),
    (
        FollowTrajectory(
            tuple(0.01 * n for n in range(1, MAX_PROFILE_POINTS + 2)), (0.0,) * 10_001
        ),
        ErrorCode.OUT_OF_RANGE,
        'times',
    ),
]


@pytest.mark.parametrize(('command', 'code', 'field'), BAD)
def test_points_that_are_not_profile_are_rejected(command, code, field):
    element = rig.device()
    element.apply(WAVE)
    rig.ticks(element, 3)
    before = rig.bits(element)
    with pytest.raises(Refused) as rejected:
        element.apply(command)
    assert (rejected.value.code, rejected.value.field) == (code, field)
    assert rig.bits(element) == before


def test_trajectory_without_end_is_rejected():
    """In time units it would end at infinity, which no snapshot can hold."""
    with pytest.raises(Refused) as rejected:
        plan_profile(FollowTrajectory((1e300,), (0.01,)), 0.0, LIMITS, 1e-4)
    assert (rejected.value.code, rejected.value.field) == (ErrorCode.OUT_OF_RANGE, 'times')


def test_trajectory_of_almost_no_time_does_not_overflow():
    hold = plan_profile(FollowTrajectory((1e-310,), (0.0,)), 0.0, LIMITS, 1e-4)
    with np.errstate(all='raise'):
        assert (hold.strain(np.array([0.0, 20.0, 1e9])) == 0.0).all()
