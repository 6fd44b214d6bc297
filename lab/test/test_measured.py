# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The measured lattice: data, shells, forward model, and predictions that have not seen it."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mlmem_lab.measured import wave
from mlmem_lab.measured.command import measured
from mlmem_lab.measured.fits import (
    Scatter,
    fit_steady,
    fit_viscous,
    greatest_friction,
    launch_chains,
    measured_speed,
    pattern_probability,
)
from mlmem_lab.measured.runs import ALL_CASES, SILENT_CASES, Case, load_runs
from mlmem_lab.measured.wave import (
    ELEMENT_MASS,
    MEASURED_SHELLS,
    POWER,
    A,
    Losses,
    build_shell,
    launch_wave,
)

SLOW = Case(22.5, 8.0)


@pytest.fixture(scope='module')
def fit():
    """Ours, which takes a second."""
    return fit_steady()


@pytest.fixture(scope='module')
def damped():
    """The one with damping alone."""
    return fit_viscous()


def test_the_data_are_there():
    assert sum(len(load_runs(case)) for case in ALL_CASES) == 14
    assert all((len(load_runs(case)) == 0) == (case in SILENT_CASES) for case in ALL_CASES)


@pytest.mark.parametrize(
    ('case', 'speed', 'spread'),
    [((22.5, 6.0), 2.85, 0.05), ((22.5, 7.0), 1.88, 0.03), ((21.5, 8.0), 2.318, 0.005)],
)
def test_speeds_are_those_of_the_readme(case, speed, spread):
    """Where three runs agree; ours are two of them."""
    assert measured_speed(Case(*case)) == pytest.approx(speed, abs=spread)


@pytest.mark.parametrize('well', [3.7, 4.6, 5.27, 5.8, 6.5])
def test_a_blended_shell_is_smooth_and_has_its_well(well):
    """Slopes join to the printed digits of the authors' coefficients, times powers up to 6^3."""
    one = build_shell(well)
    edges, either = one.energy.edges, 1e-9
    bends = [one.energy.derivative(edges + side, 1) for side in (-either, either)]
    assert bends[0] == pytest.approx(bends[1], abs=1e-4)
    assert one.energy.derivative(0.0, 1) == 0.0
    assert abs(one.energy.derivative(well, 1)) < 1e-4
    assert one.gain() > 0.0


def test_blends_pass_through_the_measured_shells():
    u = np.linspace(-0.5, 7.0, 301)
    for one in MEASURED_SHELLS.values():
        blend = build_shell(one.well).energy.derivative(u, 1)
        assert blend == pytest.approx(one.energy.derivative(u, 1), abs=1e-12)


def test_the_forward_model_agrees_with_an_adaptive_method():
    """Written out independently; DOP853 to 1e-8. Runge-Kutta at 0.1 ms: better than 1e-3."""
    case, one, losses = Case(22.5, 6.0), build_shell(3.971), Losses(0.02, 0.01)
    ours = launch_wave(case, one, losses)

    def rate(t, y):
        u, v = y.reshape(2, wave.ELEMENT_COUNT + 1)
        x = min(t / wave.HAND_TIME_MS, 1.0)
        u = np.concatenate(([one.well * x * x * (3.0 - 2.0 * x)], u[1:-1], [0.0]))
        push = A * (case.spacing + np.diff(u)) ** POWER
        drag = losses.friction * v / np.hypot(v, wave.CREEP_SPEED)
        a = (push[:-1] - push[1:] + (-one.energy.derivative(u, 1) - drag)[1:-1]) / ELEMENT_MASS
        a -= losses.damping * v[1:-1]
        return np.concatenate((v, [0.0], a, [0.0]))

    t = ours.t[ours.t <= 150.0]
    found = solve_ivp(
        rate, (0.0, t[-1]), np.zeros(2 * wave.ELEMENT_COUNT + 2), 'DOP853', t, rtol=1e-7, atol=1e-8
    )
    others = found.y[1 : wave.ELEMENT_COUNT].T
    assert np.abs(ours.u[: len(t), 1:] - others).max() < 1e-3 * one.well


def test_the_energy_that_an_element_sets_free_is_what_slows_it():
    """A steady wave: gain = m damping int v^2 dt + friction x way, per element."""
    losses, one = Losses(0.02, 0.01), build_shell(3.971)
    passed = launch_wave(Case(22.5, 7.0), one, losses, last=20)
    u, dt = passed.u[:, wave.LAST], passed.t[1]
    v = np.gradient(u, dt)
    regular = np.abs(v) / np.hypot(v, wave.CREEP_SPEED)
    lost = (
        (ELEMENT_MASS * losses.damping * v + losses.friction * np.sign(v) * regular) * v
    ).sum() * dt
    assert lost == pytest.approx(one.gain(), rel=0.02)  # it still swings a little at the end


def test_a_speed_that_was_not_fitted(fit, damped):
    """The only steady wave that the fit has not seen; damping alone misses it by 14 %."""
    case = Case(22.5, 7.0)
    assert case not in fit.fitted
    assert fit.speed(case) == pytest.approx(measured_speed(case), rel=0.05)
    assert damped.speed(case) > 1.1 * measured_speed(case)


def test_no_friction_silences_7_cm_alone(fit):
    """Whatever stops a wave there stops it at 22.5/8 first."""
    greater = 1.5 * greatest_friction(SLOW, fit)
    for case in SILENT_CASES:
        losses = replace(fit.losses[case.rail], friction=greater)
        assert np.isfinite(launch_wave(case, build_shell(fit.well(case)), losses).speed)


def test_random_chains_are_those_of_their_seed(damped):
    scatter = Scatter(0.03, 0.005)
    first, again = (
        launch_chains(SLOW, damped, scatter, 3, np.random.default_rng(5)) for _ in range(2)
    )
    assert [each.speed for each in first] == [each.speed for each in again]
    assert len({each.speed for each in first}) == 3


def test_the_pattern_needs_all_nine():
    seen = {case: float(case in SILENT_CASES) for case in ALL_CASES}
    assert pattern_probability(seen) == 1.0
    assert pattern_probability(seen | {SLOW: 0.5}) == 0.5
    assert pattern_probability(seen | {SILENT_CASES[0]: 0.0}) == 0.0


def options(**changes):
    plain = {
        'chains': 0,
        'full': False,
        'curves': False,
        'particles': 250,
        'seed': 1,
        'output': None,
        'json': True,
    }
    return SimpleNamespace(**plain | changes)


def test_the_command_prints_nine_cases(capsys, tmp_path, fit, damped, monkeypatch, sketched):
    monkeypatch.setattr('mlmem_lab.measured.study.fit_steady', lambda: fit)
    monkeypatch.setattr('mlmem_lab.measured.study.fit_viscous', lambda: damped)
    assert measured.run(options(chains=1, output=tmp_path)) == 0
    cases = json.loads(capsys.readouterr().out)['cases']
    assert [(each['rail'], each['spacing']) for each in cases] == [
        tuple(case) for case in ALL_CASES
    ]
    assert {each['spacing'] for each in cases if each['fitted']} == {8}
    assert all(each['low'] <= each['high'] for each in cases)
    kept = json.loads((tmp_path / 'measured.json').read_text())
    assert kept['cases'] == cases
    assert 'CC BY 4.0' in kept['attribution']
    assert {'command', 'version', 'processor', 'seed', 'date'} <= set(kept)
    assert (tmp_path / 'measured_speeds.png').stat().st_size > 10_000
    assert (tmp_path / 'measured_fronts.svg').exists()


def test_the_command_refuses_what_it_cannot_do(capsys, tmp_path):
    assert measured.run(options(chains=-1)) == 2
    assert '--chains and --seed must be at least 0' in capsys.readouterr().err
    (tmp_path / 'file').touch()
    assert measured.run(options(output=tmp_path / 'file')) == 2
    assert '--output must be a writable folder' in capsys.readouterr().err
