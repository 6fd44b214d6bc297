# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actuator: set-points, ramps, strain cycles and timed profiles, within both limits. The
transducers: what they hold and release, the pulses, and the waves that may still return.
"""

import dataclasses
import math

import numpy as np
import pytest
import rig
from hypothesis import assume, given
from hypothesis import strategies as st
from suite import expect_rejection

from mlmem import FollowTrajectory, Read, Refused, SetStrain, Settings, SettingsError, Write
from mlmem.instrument.actuator import MAX_PROFILE_POINTS, Actuator, plan_profile
from mlmem.instrument.blocks import follow_ramps, run
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.echo import compute_weights, filter_carrier
from mlmem.instrument.end import End, EndMove, Pulse
from mlmem.instrument.instrument import Instrument
from mlmem.instrument.motion import Cycle, CycleSettings, Ramp, shape_ramp
from mlmem.instrument.transducer import UNLIMITED_SAMPLES, Returns, Reverberation, Transducer
from mlmem.physics import CASE_II, Chain
from mlmem.physics.waves import pass_band
from mlmem.settings import ActuatorSettings, ProbeSettings

LIMITS = ActuatorSettings(max_strain=0.08, max_rate=1e-4)
STEP = 0.25
STEP_TIMES = np.arange(1, 81) * STEP
"""Ends of the steps of a tick of 20 time units."""


def rates(start, trace):
    return np.diff(np.concatenate(([start], trace))) / STEP


@pytest.mark.parametrize(
    ('target', 'requested', 'duration'),
    [
        (0.05, None, 750.0),  # a set-point moves at the rate limit: 1.5 x 0.05 / 1e-4
        (-0.08, None, 1200.0),
        (0.048, 1200.0, 1200.0),
        (0.06, 100.0, 900.0),  # not faster than the limit, and no longer than it needs
    ],
)
def test_move_is_cubic_at_rest_at_both_ends(target, requested, duration):
    """A smooth ramp's greatest rate is 1.5 of its mean."""
    moved = Actuator(LIMITS)
    if requested is None:
        assert moved.slew_to(target)
    else:
        moved.ramp_to(target, requested)
    trace = np.empty(0)
    while moved.is_moving:
        trace = np.append(trace, moved.advance(STEP_TIMES))
    assert moved.motion.duration == pytest.approx(duration)
    x = np.minimum(np.arange(1, len(trace) + 1) * STEP / duration, 1.0)
    cubic = np.polynomial.Polynomial([0.0, 0.0, 3.0, -2.0])  # p(0)=p'(0)=p'(1)=0, p(1)=1
    np.testing.assert_allclose(trace, target * cubic(x), atol=1e-15)
    assert np.abs(rates(0.0, trace)).max() <= LIMITS.max_rate * (1 + 1e-9)
    assert moved.strain == target  # exactly
    assert (moved.advance(STEP_TIMES) == target).all()
    assert not moved.slew_to(target)


MOVES = st.tuples(
    st.floats(-0.08, 0.08), st.floats(1.0, 3000.0), st.booleans(), st.integers(0, 60)
)


@rig.unhurried
@given(st.lists(MOVES, min_size=1, max_size=6))
def test_no_sequence_of_moves_exceeds_rate_or_overshoots(moves):
    moved = Actuator(LIMITS)
    for target, duration, smooth, ticks in moves:
        start = moved.strain
        if smooth:
            moved.ramp_to(target, duration)
        else:
            moved.slew_to(target)
        for _ in range(ticks):
            before = moved.strain
            trace = moved.advance(STEP_TIMES)
            # a difference of strains up to 0.08 is rounded to some 1e-17
            assert np.abs(rates(before, trace)).max() <= LIMITS.max_rate + 1e-16 / STEP
            assert min(start, target) - 1e-17 <= trace.min()
            assert trace.max() <= max(start, target) + 1e-17
        if not moved.is_moving and ticks:
            assert moved.strain == target


def test_repeated_set_point_goes_on_with_its_move():
    """A loop sends its set-point every period; the move is the one of a single set-point."""
    once, again = Actuator(LIMITS), Actuator(LIMITS)
    assert once.slew_to(0.05)
    for tick in range(40):
        assert again.slew_to(0.05) == (tick == 0)
        np.testing.assert_array_equal(again.advance(STEP_TIMES), once.advance(STEP_TIMES))
    assert again.slew_to(0.04), 'another one is another move'


def test_set_points_and_profiles_strain_the_material():
    """V_N is the strain times N, its speed at most that of the actuator times N."""
    element = rig.device()
    element.apply(SetStrain(0.01))
    speeds = []
    while element.actuator.is_moving or not speeds:
        element.advance()
        speeds.append(element.substrate_speed)
        stretched = element.chain.V_N
        assert stretched == pytest.approx(element.actuator.strain * rig.DESIGN.N, rel=1e-15)
    assert element.actuator.strain == 0.01
    assert stretched == pytest.approx(1.25, rel=1e-15)
    assert max(speeds) == pytest.approx(1e-4 * rig.DESIGN.N, rel=0.02)  # the mean of a tick
    assert len(speeds) == 8  # 1.5 x 0.01 / 1e-4 is 7.5 ticks of 20
    element.advance()
    assert element.substrate_speed == 0.0
    rig.ticks(element, FollowTrajectory((0.0, 0.1), (0.01, 0.03)), 25)  # it begins at this strain
    assert element.actuator.strain == pytest.approx(0.02, abs=1e-16)  # half-way
    rig.ticks(element, FollowTrajectory((0.1,), (0.0,)), 25)  # it takes the place of the first
    assert element.actuator.strain == pytest.approx(0.01, abs=1e-16)
    rig.ticks(element, SetStrain(0.02), 8)  # as a set-point does
    assert element.actuator.strain == 0.02
    assert not element.actuator.is_moving


UNIT = 1e-4
"""Of time, in seconds: so the rate limit is 1/s and a tick of 20 time units 2 ms."""

POINTS = st.tuples(st.floats(0.01, 0.5), st.floats(-0.08, 0.08), st.floats(-1.0, 1.0))


@rig.unhurried
@given(st.lists(POINTS, min_size=1, max_size=5), st.booleans())
def test_exactly_profiles_within_both_limits_are_taken(points, with_rates):
    waits, strains, rates = zip(*points, strict=True)
    times = tuple(np.cumsum(waits).tolist())
    command = FollowTrajectory(times, strains, rates if with_rates else ())
    t = np.linspace(0.0, times[-1], 20_001)
    if with_rates:
        from scipy.interpolate import CubicHermiteSpline  # slow to import, by every worker

        oracle = CubicHermiteSpline([0.0, *times], [0.0, *strains], [0.0, *rates])(t)
    else:
        oracle = np.interp(t, [0.0, *times], [0.0, *strains])
    # the sampled rate misses its peak by the curvature over a step
    over = max(np.abs(oracle).max() / 0.08, np.abs(np.diff(oracle) / np.diff(t)).max())
    assume(abs(over - 1.0) > 1e-3)
    if over > 1.0:
        with pytest.raises(Refused, match=r'must be within .* \(actuator\.max_'):
            plan_profile(command, 0.0, LIMITS, UNIT)
    else:
        np.testing.assert_allclose(
            plan_profile(command, 0.0, LIMITS, UNIT).strain(t / UNIT), oracle, atol=1e-14
        )


MANY_TIMES = tuple(0.01 * n for n in range(1, MAX_PROFILE_POINTS + 2))

BAD_PROFILES = {
    ('out_of_range', 'joint'): [((0.1,), (0.01,), (), 'elbow')],
    ('out_of_range', 'times'): [
        ((), ()), ((0.0,), (0.0,)), ((math.inf,), (0.01,)), (MANY_TIMES, (0.0,) * len(MANY_TIMES)),
        ((1e306,), (0.01,)),  # in time units it would end at infinity, which no snapshot can hold
    ],
    ('conflict', 'times'): [
        ((0.2, 0.1), (0.01, 0.0)), ((0.1, 0.1), (0.01, 0.01)), ((-0.1, 0.1), (0.0, 0.01)),
    ],
    ('conflict', 'strains'): [((0.1, 0.2), (0.01,)), ((0.0, 0.1), (0.01, 0.01))],
    ('out_of_range', 'strains'): [
        ((0.1,), 0.01), ((0.1,), (math.nan,)), ((0.1,), ('0.01',)), ((0.1,), (10**400,)),
        ((0.1, 0.3), (0.05, 0.0801)),
        ((0.1, 0.2), (0.075, 0.075), (0.0, -0.9)),  # it bulges between its points
    ],
    ('conflict', 'rates'): [((0.1, 0.2), (0.01, 0.0), (0.0,))],
    ('out_of_range', 'rates'): [
        ((0.1,), (0.01,), (math.nan,)), ((0.1, 0.11), (0.01, 0.021)), ((0.1,), (0.08,), (0.0,)),
        ((5e-324,), (0.01,)),
    ],
}  # fmt: skip


@pytest.mark.parametrize(('code', 'field'), BAD_PROFILES)
def test_points_that_are_not_profile_are_rejected(code, field):
    element = rig.device()
    element.apply(FollowTrajectory((0.1, 0.2, 0.4), (0.05, -0.01, 0.0), (0.0, -0.5, 0.0)))
    rig.ticks(element, 3)
    before = rig.bits(element)
    for points in BAD_PROFILES[code, field]:
        with expect_rejection(Refused, code, field):
            element.apply(FollowTrajectory(*points))
        assert rig.bits(element) == before


def test_trajectory_of_almost_no_time_does_not_overflow():
    hold = plan_profile(FollowTrajectory((1e-310,), (0.0,)), 0.0, LIMITS, UNIT)
    with np.errstate(all='raise'):
        assert (hold.strain(np.array([0.0, 20.0, 1e9])) == 0.0).all()


PEAK = -0.03
PLAIN = CycleSettings(ramp=400.0, hold=200.0, release=300.0, settle=100.0)
EASED = dataclasses.replace(PLAIN, ease=200.0, ease_to=0.25)


@pytest.mark.parametrize('max_rate', [2e-3, 1e-4])
@pytest.mark.parametrize('times', [PLAIN, EASED])
def test_planned_cycle_equals_that_of_device(times, max_rate):
    """At every tick, with an actuator that follows and with one too slow for the ramps."""
    settings = Settings(actuator=ActuatorSettings(max_rate=max_rate))
    instrument, seen = Instrument(CASE_II, settings), []
    procedure = follow_ramps(instrument, Cycle.plan_cycle(times, PEAK))
    run(instrument, procedure, lambda: seen.append(instrument.actuator.strain))
    seen = [*seen[1:], instrument.actuator.strain]
    told = Cycle.plan_cycle(times, PEAK, max_rate)
    assert len(seen) * instrument.tick == pytest.approx(told.duration, abs=3 * instrument.tick)
    if max_rate == 2e-3:  # nothing is put off to the next tick
        assert told.duration == 1000.0 + times.ease
        at = instrument.tick * np.arange(1, len(seen) + 1)
        assert told.strain(at) == pytest.approx(seen, abs=1e-12)


@pytest.mark.parametrize('delay', [6.7, 40.0, 55.0])
def test_move_in_two_half_steps_is_mean_of_two_moves(delay):
    """Also if the second begins after the first has ended."""
    ramp, t = Ramp(0.01, PEAK, 40.0), np.linspace(0.0, 120.0, 1201)
    moved = shape_ramp(ramp, delay)
    assert moved.duration == 40.0 + delay
    assert moved.target == PEAK
    late = np.where(t < delay, ramp.start, ramp.strain(np.maximum(t - delay, 0.0)))
    assert moved.strain(t) == pytest.approx(0.5 * (ramp.strain(t) + late), abs=1e-15)
    actuator = Actuator(ActuatorSettings(max_rate=1.0))
    for duration in (60.0, 5.0):  # the second is too short for it, and is made in one step
        actuator.ramp_to(PEAK, duration, delay)
        assert actuator.remaining_time == pytest.approx(duration)


@pytest.mark.parametrize('shaped', [False, True])
def test_cycle_pauses_on_way_back_and_takes_stated_time(shaped):
    """Shaped, it begins with half of a ramp that is shorter by half a period of the cells."""
    element = rig.shipped('bits_2', write={'final_settle': 0.0, 'shaped': shaped})
    rig.succeed(element, Write(0))
    element.apply(Write(2))
    strain = []
    for _ in range(round(620.0 / element.tick)):
        element.advance()
        strain.append(element.actuator.strain)
    write = element.settings.write
    at = np.cumsum([write.ramp, write.hold, write.ease, write.release]) / element.tick - 1
    seen = np.array(strain)[at.astype(int)] / write.compression
    np.testing.assert_allclose(seen, [1.0, 1.0, write.ease_to, 0.0], atol=1e-12)
    delay = math.pi / math.sqrt(element.design.k_s1) if shaped else 0.0
    ramp = Ramp(0.0, write.compression, write.ramp - delay)
    first = (shape_ramp(ramp, delay) if shaped else ramp).strain(np.array([element.tick]))
    assert strain[0] == pytest.approx(first[0])
    assert np.all(np.array(strain)[int(at[-1]) :] == 0.0)
    assert element.procedure == 'write'  # which ends with a read


def test_move_may_end_within_step():
    """The first stages after 10.0 end at 10.056 and 10.089: beyond 10.05, and within 10.07."""
    first_stage = 0.1786178958448091 - 0.06626458266981849  # of a step: xi + chi of PEFRL
    element = rig.device()
    start = element.design.D_s1
    element.transducer.drive_end(End.LEFT, EndMove(start, start + 1.005, speed=0.1))
    held_cell = element.transducer.held_cell(40)
    assert held_cell.motion.shape == (2, 100)  # 20 whole steps to 10.0
    assert held_cell.motion[0, -1] == pytest.approx(start + 1.0, abs=1e-14)
    element.transducer.drive_end(End.LEFT, EndMove(start, start + 1.007, speed=0.1))
    held_cell = element.transducer.held_cell(40)
    assert held_cell.motion.shape == (2, 101)  # and the first stage of the next, to 10.056
    assert held_cell.motion[0, -1] == pytest.approx(start + 1.0 + 0.05 * first_stage, abs=1e-14)


def test_noise_is_distinguished_from_motion_in_stiff_element():
    """With Case II's edge its fastest waves would be taken for the sensor's noise."""
    design = dataclasses.replace(CASE_II, N=60, d=2.0, s_min=1e4, s_max=3e4)
    chain = Chain(design)
    probe = ProbeSettings(omega_c=1.0)
    transducer = Transducer(
        chain.design, Settings(probe=probe, probe_right=probe), Simulation(chain)
    )
    t = chain.dt * np.arange(transducer.recent.shape[1])
    wave = 1e-3 * np.sin(pass_band(design.k_s2)[1] * t)
    transducer.record(np.stack((wave, wave)))
    assert transducer.measure_unrest(End.LEFT) > 5e-4
    assert transducer.noise(End.LEFT) < 1e-6


def test_rest_of_too_many_samples_is_rejected():
    chain = Chain(dataclasses.replace(CASE_II, N=60), dt=1e-3)
    probe = ProbeSettings(omega_c=1e-3)
    with expect_rejection(SettingsError, 'conflict', 'omega_c'):
        Transducer(chain.design, Settings(probe=probe, probe_right=probe), Simulation(chain))


def printed(t, omega_c, A=0.01, sigma=8.0):
    """Return v - rest as page 5 prints it."""
    return A * np.exp(-0.5 * ((t - 6 * sigma) / sigma) ** 2) * np.sin(omega_c * t)


def derivative(motion, t, h=1e-4):
    """Return dv/dt by central differences, with an error of h^2 / 6 times the third derivative."""
    return (motion.evaluate_motion(t + h)[0] - motion.evaluate_motion(t - h)[0]) / (2 * h)


@pytest.mark.parametrize(
    ('end', 'omega_c', 'rest'), [(End.LEFT, 2.1, 1.0029), (End.RIGHT, 0.7, -0.9979)]
)
def test_pulse_is_enforced_at_end_of_real_chain(end, omega_c, rest):
    """After every step v is the printed one; at every tick's end so is its velocity."""
    element = rig.device(level=3, probe_right=ProbeSettings(omega_c=0.7))
    row, cell = (0, 0) if end == 'left' else (1, -1)
    rest_here = element.transducer.measure_rest(end)
    assert rest_here == pytest.approx(rest, abs=1e-3)
    element.transducer.fire_probe(end)
    pulse = Pulse(rest_here, ProbeSettings(omega_c=omega_c))
    heard = []
    for tick in range(1, 5):  # to 80 of 96 time units
        element.advance()
        heard.append(element.transducer.recent[row, -element.steps_per_tick :])
        velocity = element.chain.velocity[cell]
        assert velocity == pytest.approx(derivative(pulse, np.array([20.0 * tick]))[0], abs=1e-10)
    t = np.arange(1, 4 * element.steps_per_tick + 1) * element.driver.dt
    np.testing.assert_allclose(np.concatenate(heard) - rest_here, printed(t, omega_c), atol=1e-14)
    element.advance()  # the pulse ends within this tick; then the cell rings down freely
    v = element.transducer.recent[row, -element.steps_per_tick :] - rest_here
    t = 80.0 + np.arange(1, element.steps_per_tick + 1) * element.driver.dt
    held = t <= 96.0
    np.testing.assert_allclose(v[held], printed(t, omega_c)[held], atol=1e-14)
    # it would be within 0.01 exp(-18) = 1.5e-10 of rest if it were still held
    assert np.abs(v[~held]).max() > 1e-7
    assert not element.transducer.is_driving


DT, TICK = 0.5, 40
"""Samples of Case II: 40 in a tick."""


def follower(design=CASE_II):
    return Reverberation(design, Settings().probe_right, DT)


def fed(reverberation, v, past=None):
    """Let an end be seen moving for whole ticks, by default at rest before."""
    past = np.zeros(reverberation.memory) if past is None else past
    reverberation.follow_samples(np.concatenate((past, v)), len(v) // TICK)


def wave(samples, amplitude=1e-3, omega=0.7):
    return amplitude * np.sin(omega * DT * np.arange(samples))


def test_bound_is_greatest_mean_of_tick_and_fades_as_waves():
    """As exp(-eta t / 2), which is the slowest that a wave can lose."""
    reverberation = follower()
    v = np.concatenate((wave(20 * TICK), np.zeros(60 * TICK)))
    fed(reverberation, v)
    kernel = compute_weights(Settings().probe_right, DT)
    loud = np.abs(filter_carrier(np.concatenate((np.zeros(reverberation.memory), v)), kernel))
    means = loud.reshape(-1, TICK).mean(axis=1)
    fade = math.exp(-0.5 * CASE_II.eta * 20.0)
    expected = max(mean * fade ** (len(means) - 1 - n) for n, mean in enumerate(means))
    assert reverberation.returns.bound == pytest.approx(expected, rel=1e-12)
    before = reverberation.returns.bound
    fed(reverberation, np.zeros(50 * TICK))
    assert reverberation.returns.bound == pytest.approx(before * fade**50, rel=1e-12)
    undamped = follower(design=dataclasses.replace(CASE_II, eta=0.0))
    fed(undamped, wave(20 * TICK))
    before = undamped.returns.bound
    fed(undamped, np.zeros(500 * TICK))
    assert undamped.returns.bound == before
    assert undamped.count_fading_samples(0.5 * before) == UNLIMITED_SAMPLES


def test_time_until_bound_has_faded_is_forecast():
    reverberation = follower()
    fed(reverberation, wave(20 * TICK))
    limit = 0.1 * reverberation.returns.bound
    samples = reverberation.count_fading_samples(limit)
    assert samples * DT == pytest.approx(math.log(10.0) * 2.0 / CASE_II.eta, abs=DT)
    fed(reverberation, np.zeros(samples // TICK * TICK))
    assert reverberation.returns.bound >= limit
    fed(reverberation, np.zeros(TICK))
    assert reverberation.returns.bound <= limit
    assert reverberation.count_fading_samples(limit) == 0


def test_end_ignores_its_own_drive_but_for_what_returns():
    """Until the filter's memory has passed the motion; waves that return are counted."""
    reverberation = follower()
    pulse = wave(3 * TICK, amplitude=0.01)
    reverberation.ignore_samples(len(pulse))
    assert reverberation.returns == Returns(0.0, 0, len(pulse) + reverberation.memory)
    fed(reverberation, pulse)
    after = math.ceil(reverberation.memory / TICK)
    past = np.concatenate((np.zeros(TICK), pulse))[-reverberation.memory :]
    fed(reverberation, np.zeros(after * TICK), past=past)
    assert reverberation.returns.bound < 1e-12
    assert reverberation.returns.since == (3 + after) * TICK
    fed(reverberation, wave(5 * TICK))
    assert reverberation.returns.bound == pytest.approx(1e-3 * 2.0 / math.pi, rel=0.1)


@pytest.mark.parametrize('level', [0, 3, 7])
def test_waves_stay_below_bound_after_pulses_returned(level):
    """In each tick of the next 6000 time units, against the bound of every tick before.

    Waves of a packet that disperse may meet others again: at level 3 the left end once sees 1.53
    times the bound. The third of the threshold that may be under way leaves a factor of 3.
    """
    element = rig.device(level, design=CASE_II)
    rig.succeed(element, Read())
    rig.ticks(element, math.ceil(max(element.passage_time(end) for end in End) / element.tick))
    kernels = [compute_weights(end.select_probe(element.settings), DT) for end in End]
    bounds, heard = [], []
    for _ in range(300):
        element.advance()
        each_end = element.transducer.reverberation
        bounds.append([each_end[end].returns.bound for end in End])
        padded = np.pad(element.transducer.recent, ((0, 0), (TICK, 0)), 'mean')
        ends = zip(padded, kernels, strict=True)
        heard.append([np.abs(filter_carrier(v, kernel))[-TICK:].mean() for v, kernel in ends])
    compensated = np.exp(0.5 * CASE_II.eta * element.tick * np.arange(300))[:, None]
    most_to_come = np.maximum.accumulate((np.array(heard) * compensated)[::-1])[::-1]
    assert (most_to_come <= 1.6 * np.array(bounds) * compensated).all()
