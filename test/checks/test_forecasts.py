# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forecasts of checks: echoes by linear waves against the chain itself with a small pulse, walls
under slow strain in an excerpt against the whole element, and read disturb against the device.

The delays of every level at either end are in test_calibration.py.
"""

import dataclasses
import math

import numpy as np
import pytest
import rig
from suite import sampled

from mlmem import (
    Abort,
    Erase,
    Locate,
    MemoryElement,
    Read,
    Refused,
    SetStrain,
    Write,
    factory_calibration,
    load_element,
    snapshot,
)
from mlmem.instrument.end import End
from mlmem.physics import CASE_II, Chain, HeldCell, Scatter, Specimen, draw_specimen, substep_times
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.held_wall import hold_walls
from mlmem.physics.pefrl import squared_frequency
from mlmem_tools.checks import Verdict, disturb
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.echoes import echo_response
from mlmem_tools.checks.excerpt import cut_excerpt
from mlmem_tools.checks.quasistatic import (
    compute_held_landscape,
    compute_self_energy,
    find_depinning_strain,
)


def test_no_frequencies_have_no_squares():
    """Those of a pulse whose band lies between two frequencies of the window."""
    assert squared_frequency(np.array([]), 0.004, 0.25).shape == (0,)


def test_right_end_hears_what_the_left_one_of_its_mirror_does():
    made = draw_specimen(CASE_II, Scatter(alpha=0.01, k_r=0.01, offset=0.01), 3)
    mirrored = Specimen(
        CASE_II,
        made.alpha[::-1] / CASE_II.alpha,
        made.k_r[::-1],
        offset=made.offsets[::-1],
    )
    v, omega = find_pinned_wall(made, 1), np.linspace(0.5, 0.75, 11)
    heard = echo_response(made, v, omega, End.RIGHT)
    assert np.abs(heard).max() > 0.1
    assert heard == pytest.approx(echo_response(mirrored, v[::-1], omega, End.LEFT), rel=1e-9)


@pytest.mark.parametrize('k_r', [0.0, 0.003])
def test_chain_returns_what_the_linear_waves_say(k_r):
    """A pulse of 1e-5 cells into Case II with its wall at level 1, all of its echo's waveform.

    The springs' scatter alone changes it by 30 %.
    """
    dt, duration, sigma, carrier = 0.25, 420.0, 8.0, 2.0
    made = draw_specimen(CASE_II, Scatter(k_r=k_r), 3)
    v = find_pinned_wall(made, 1)

    def pulse(t):
        x = (t - 48.0) / sigma
        return 1e-5 * np.exp(-0.5 * x * x) * np.sin(carrier * t)

    chain = Chain(made, dt)
    chain.place(v)
    rest = chain.end(1)
    steps = round(duration / dt)
    times = substep_times(steps, dt)
    held = times[times <= 96.0]
    motion = np.stack((rest + pulse(held), np.gradient(pulse(held), held)))
    heard = chain.advance(np.zeros(len(times)), HeldCell(1, motion))[0] - rest
    period = 4 * steps
    t = np.arange(1.0, period + 1.0) * dt
    omega = 2.0 * np.pi * np.fft.rfftfreq(period, dt)
    used = np.abs(omega - carrier) < 5.0 / sigma
    spectrum = np.where(used, np.fft.rfft(np.where(t <= 96.0, pulse(t), 0.0)), 0.0)
    spectrum[used] *= echo_response(made, v, omega[used], End.LEFT, dt)
    forecast = np.fft.irfft(spectrum, period)[:steps]
    echo = t[:steps] > 170.0
    scale = np.abs(heard[echo]).max()
    # What the forecast leaves out: the ring-down of the end that is let go.
    assert np.abs(heard - forecast)[echo].max() < 0.06 * scale


# --- walls under slow strain ---------------------------------------------------------------------


@pytest.mark.parametrize(('low', 'high'), [(30, 60), (110, 140), (190, 224)])
def test_excerpt_has_the_cells_of_the_element(low, high):
    made = draw_specimen(CASE_II, Scatter(alpha=0.01, k_r=0.01, s=0.01, mass=0.01, offset=0.01), 1)
    made = dataclasses.replace(made, stuck=(low, high))
    part = cut_excerpt(made, low, high)
    cells = slice(part.before, part.before + part.design.N)
    assert part.before % CASE_II.J == 0  # the defects stay where they are
    assert part.before < low
    assert part.design.N < CASE_II.N
    amplitude = made.alpha[cells] * CASE_II.d
    assert part.made.alpha * part.design.d == pytest.approx(amplitude, rel=1e-13)
    for springs in ('k_r', 's'):  # between the cells
        own, whole = getattr(part.made, springs), getattr(made, springs)
        assert own == pytest.approx(whole[cells][: part.design.N - 1], rel=1e-13)
    for values in ('masses', 'offsets'):
        assert (getattr(part.made, values) == getattr(made, values)[cells]).all()
    assert part.made.stuck == (low - part.before, high - part.before)


@pytest.mark.parametrize('X', [40.0, 140.0, 200.0])
def test_wall_in_an_excerpt_is_that_of_the_element(X):
    """The error is exp(-DECAY) = 6e-6 of the strain's effect on a free edge."""
    part = compute_held_landscape(CASE_II, X, X + 8.0, strain=0.02)
    V = CASE_II.end_displacement(0.02) * CASE_II.strain_shape
    whole = hold_walls(CASE_II, part.X, V).energy
    assert np.ptp(whole) > 4e-3
    assert part.energy == pytest.approx(whole - whole[0], abs=2e-7)


@pytest.mark.parametrize(
    ('level', 'sign', 'kink', 'expected'),
    [
        (0, -1, False, -0.0204),  # the device makes this step from -0.021 on
        (1, +1, False, +0.0355),  # from +0.036 on
        (0, +1, True, +0.0150),  # the kink of an erase: from +0.016 on
        (1, -1, True, -0.0310),  # from -0.032 on
    ],
)
def test_strains_that_free_a_wall(level, sign, kink, expected):
    found = find_depinning_strain(CASE_II, level, sign, 0.1, kink=kink, tolerance=1e-4)
    assert found == pytest.approx(expected, abs=3e-4)


def test_no_strain_frees_a_wall_from_a_very_soft_defect():
    deep = dataclasses.replace(CASE_II, beta=-0.6)
    assert math.isnan(find_depinning_strain(deep, 0, -1.0, 0.04))


def test_gain_of_a_wall_is_half_its_energy_over_s():
    """In a uniform substrate: the springs hold half the wall's energy, sum v'^2 = E."""
    even = dataclasses.replace(CASE_II, s_min=500.0, s_max=500.0)
    _, gain = compute_self_energy(even)
    flat = dataclasses.replace(even, gamma=0.0, beta=0.0)
    (total,) = hold_walls(flat, np.array([112.5]), np.zeros(flat.N)).energy
    assert np.ptp(gain) < 1e-12
    assert gain[0] == pytest.approx(-0.5 * total / 500.0, rel=0.02)  # lattice against continuum


# --- how loud a pulse of a read may be -----------------------------------------------------------


def as_loud(name, end, A):
    """Return a preset whose pulse of an end has an amplitude; the threshold rises with it."""
    design, settings = load_element(name).design_and_settings
    probe = end.select_probe(settings)
    louder = dataclasses.replace(probe, A=A, v_th=min(1.0, probe.v_th * A / probe.A))
    group = 'probe' if end is End.LEFT else 'probe_right'
    return design, dataclasses.replace(settings, **{group: louder})


def forecast_disturb(design, settings):
    (finding,) = disturb.check(Subject(design, settings))
    return finding


@pytest.mark.parametrize(('name', 'end', 'level'), sampled(
    [('case_2', End.LEFT, 0), ('case_2', End.RIGHT, 7), ('bits_2', End.LEFT, 0),
     ('bits_2', End.RIGHT, 3), ('kick_2', End.LEFT, 0)],
    lambda case: case[0] == 'bits_2',
))  # fmt: skip
def test_pulse_limit_is_that_of_the_device(name, end, level):
    """On the whole device: it fires from either end, and rests in between."""
    shipped, stayed = load_element(name).design_and_settings, []
    limit = forecast_disturb(*shipped).values[end.value]
    for share in (1.0, 1.6):
        louder = as_loud(name, end, min(0.5, share * limit))
        element = rig.pin(MemoryElement(*louder, factory_calibration(*shipped)), level)
        element.perform(Read())
        element.advance(500)
        stayed.append(rig.true_level(element) == level)
    assert stayed == [True, False]


def test_read_that_moves_the_wall_fails_the_check():
    """Whatever is set, the limit is the same, but for the steps in which it is found."""
    for A, verdict in ((0.01, Verdict.PASS), (0.1, Verdict.WARN), (0.4, Verdict.FAIL)):
        finding = forecast_disturb(*as_loud('bits_2', End.LEFT, A))
        assert finding.verdict is verdict
        assert 0.12 < finding.values['left'] < 0.17
    assert forecast_disturb(*load_element('kick_2').design_and_settings).verdict is Verdict.PASS


@pytest.mark.parametrize('command', [Read(), Locate(), Write(3), Erase()])
def test_pulse_that_may_move_the_wall_is_rejected(command):
    element = MemoryElement(*as_loud('case_2', End.LEFT, 0.4))
    element.loudest = {End.LEFT: 0.28, End.RIGHT: 0.2}
    before = snapshot.take_snapshot(element)
    with pytest.raises(Refused, match=r'probe.A must be at most 0.28'):
        element.apply(command)
    assert snapshot.take_snapshot(element) == before
    element.apply(SetStrain(0.001))
    assert element.perform(Abort()).success
