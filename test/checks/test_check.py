# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design checker: the paper's elements pass, and every spoiled one fails for its reason."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
import rig

from mlmem import MemoryElement, Settings, factory_calibration, load_element
from mlmem.instrument.end import End
from mlmem.moves.kick import KickMotion
from mlmem.parsing import decode_value, encode_value
from mlmem.physics import CASE_II, Chain, wall_energy
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.held_wall import hold_walls
from mlmem.settings import ActuatorSettings
from mlmem_tools import checks
from mlmem_tools.checks import (
    Report,
    Verdict,
    check,
    disturb,
    echoes,
    launch,
    material,
    pinning,
    schedule,
    steps,
    transducer,
)  # fmt: skip
from mlmem_tools.checks.concern import Subject
from mlmem_tools.checks.echoes import forecast_echo
from mlmem_tools.checks.launch import simulate_launch
from mlmem_tools.cli.main import main


@pytest.fixture(scope='module')
def case_ii():
    return check(CASE_II)


SHORT = replace(CASE_II, N=125)
"""Four of the eight levels of Case II: what is wrong with its cells is wrong with these."""


def part(concerns, design=SHORT, settings=None, **changes):
    """Return the findings of some modules on a changed design."""
    subject = Subject(replace(design, **changes), settings or Settings())
    return Report(tuple(finding for concern in concerns for finding in concern.check(subject)))


def settings_with(**groups):
    """Return the default settings but for some values of some groups."""
    return decode_value(Settings, encode_value(Settings()) | groups)


def failed(report):
    return {finding.name for finding in report.of(Verdict.FAIL)}


# --- the shipped elements --------------------------------------------------------------------


@pytest.mark.parametrize(('J_s', 'verdict'), [(50, Verdict.PASS), (75, Verdict.WARN)])
def test_substrate_must_alternate_from_level_to_level(J_s, verdict):
    report = part((material,), J_s=J_s)
    assert [each.verdict for each in report.findings if each.name == 'levels'] == [verdict]


def test_case_ii_passes_everything(case_ii):
    assert case_ii.verdict is Verdict.PASS


def test_case_i_warns_of_its_carriers_only():
    """Its potential is six times weaker and its bands nearly the same; one level has no steps."""
    case_i = check(*load_element('case_1').design_and_settings)
    assert case_i.verdict is Verdict.WARN
    assert {finding.name for finding in case_i.of(Verdict.WARN)} == {
        'carrier_left', 'carrier_right',
    }  # fmt: skip
    names = [finding.name for finding in case_i.findings]
    assert 'launch_write' in names
    assert 'write_steps' not in names


def test_brief_check_leaves_out_what_passes(capsys, monkeypatch):
    monkeypatch.setattr(checks, 'CHECK_MODULES', (material,))
    assert main(['design', 'check', 'case_1', '--brief']) == 0
    printed = capsys.readouterr().out
    assert 'carrier_left' in printed
    assert 'stiffnesses' not in printed
    assert main(['design', 'check', 'case_1', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['verdict'] == 'warn'


def test_numbers_of_case_ii(case_ii):
    """Against measurements on the device and closed forms."""
    energy = wall_energy(CASE_II)
    flat = replace(CASE_II, gamma=0.0, beta=0.0)
    (held,) = hold_walls(flat, np.array([112.5]), np.zeros(225)).energy
    assert energy == pytest.approx(held, rel=0.01)  # continuum against lattice
    ours = case_ii['peierls_nabarro'].values
    assert ours['barrier'] == pytest.approx(1.1669e-5, rel=0.01)  # SciPy, lab/results/paper.json
    assert ours['gradient force'] == pytest.approx(4e-4 / 3 * energy / 2, rel=0.01)
    first, last = case_ii['gradient'].values.values()
    # E grows with the root of alpha: -gamma E / (2 alpha)
    assert last / first == pytest.approx(0.97**-0.5, rel=1e-3)
    needed = case_ii['write_peaks'].values
    assert needed['compression needed'] == pytest.approx(-0.0204, abs=3e-4)
    assert needed['tension needed'] == pytest.approx(0.0355, abs=3e-4)


# --- spoiled elements ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('groups', 'changes', 'expected'),
    [
        ({}, {'gamma': -6e-5}, {'peierls_nabarro', 'write_steps'}),
        ({'probe': {'omega_c': 2.4}}, {}, {'carrier_left', 'echo_left'}),  # printed; in no band
        ({'write': {'compression': -0.019, 'tension': 0.048}}, {}, {'write_peaks', 'write_steps'}),
    ],
)
def test_one_wrong_number_fails_what_it_touches_alone(groups, changes, expected):
    """Of all checks but the two that take most of the time; they have tests of their own."""
    concerns = [each for each in checks.CHECK_MODULES if each not in (disturb, transducer)]
    assert failed(part(concerns, settings=settings_with(**groups), **changes)) == expected


@pytest.mark.parametrize(
    ('concerns', 'changes', 'expected'),
    [
        ((material, pinning), {'gamma': 1e-4}, {'gradient', 'peierls_nabarro'}),
        # Without the cubic term both ground states have one stiffness.
        ((material, echoes), {'a': 1.2, 'b': 0.0, 'c': 2.0},
         {'stiffnesses', 'echo_left', 'echo_right'}),
        ((pinning, schedule), {'beta': 0.05}, {'pin_depth', 'write_peaks', 'erase_peaks'}),
        ((schedule,), {'beta': -0.6}, {'write_peaks', 'erase_peaks'}),
        ((material,), {'d': 0.0061, 'J': 10, 'J_s': 20, 'j_0': 6.8}, {'wall_width'}),
        ((echoes,), {'eta': 0.5}, {'echo_left', 'echo_right'}),
    ],
)  # fmt: skip
def test_spoiled_design_fails_for_its_reason(concerns, changes, expected):
    assert expected <= failed(part(concerns, **changes))


def test_peaks_near_failure_are_a_warning():
    """A tension of 0.040 frees the wall, which needs 0.0363, and 0.85 of it does not."""
    found = part((steps,), settings=settings_with(write={'tension': 0.04}))['write_steps']
    assert found.verdict is Verdict.WARN
    assert found.values == {'steps': 3, 'lost': 0, 'peaks tried': 5, 'peaks failed': 2}


def test_pulse_that_hides_the_first_levels_fails():
    """With sigma 8 in place of 6 it still rings at the left when both their echoes arrive."""
    design, settings = load_element('bits_2').design_and_settings
    assert part((echoes,), design, settings)['apart'].verdict is Verdict.PASS
    long = replace(settings, probe=replace(settings.probe, sigma=8.0))
    found = part((echoes,), design, long)['apart']
    assert (found.verdict, found.values['at the left']) == (Verdict.FAIL, 0.0)


def alike(known, level):
    """Return a calibration whose left end hears a level as it hears the one above."""
    left = known.left
    delays, shapes = list(left.delays), list(left.shapes)
    delays[level], shapes[level] = delays[level + 1], shapes[level + 1]
    return replace(known, left=replace(left, delays=tuple(delays), shapes=tuple(shapes)))


def test_levels_between_the_samples_are_compared_too(monkeypatch):
    """Of 16 levels 0, 1, 8, 9, 14 and 15 are sampled."""
    subject = Subject(*load_element('bits_4').design_and_settings)
    assert not {4, 5} & set(subject.levels)
    known = factory_calibration(subject.design, subject.settings)
    monkeypatch.setattr(echoes, 'compute_calibration', lambda *_: alike(known, 4))
    found = Report(tuple(echoes.check(subject)))['apart']
    assert found.verdict is Verdict.FAIL
    assert 'the left end hardly tells level 4 from another' in found.text


def test_large_element_is_judged_by_sampled_levels():
    subject = Subject(*load_element('bits_2').design_and_settings)
    assert 'sampled' not in Report(tuple(echoes.check(subject)))['apart'].text
    found = Report(tuple(echoes.check(subject, max_calibration_cell_steps=0.0)))['apart']
    assert found.verdict is Verdict.PASS
    assert found.text.startswith('as far as levels were sampled')


@pytest.mark.parametrize(
    ('s_min', 'substrate', 'verdict'),
    [
        (100.0, 'elastic', Verdict.FAIL),  # a cycle makes 4 of 7 steps (lab/results/paper.json)
        (400.0, 'elastic', Verdict.FAIL),  # so does this
        (100.0, 'rigid', Verdict.WARN),  # the model knows nothing of it, a built one would
        (1000.0, 'elastic', Verdict.PASS),  # all steps
    ],
)
def test_soft_substrate_traps_the_wall(s_min, substrate, verdict):
    report = part((pinning,), s_min=s_min, s_max=3.0 * s_min, substrate=substrate)
    assert report['rigidity'].verdict is verdict
    assert failed(report) == ({'rigidity'} if verdict is Verdict.FAIL else set())


def test_trap_too_near_the_end_loses_the_wall():
    """The device also loses it: the wall swings back and out of the free end."""
    near = replace(CASE_II, J=10, J_s=20, j_0=6.8)
    assert 'launch_write' in failed(part((launch,), near))
    assert math.isnan(simulate_launch(Subject(near, Settings()), 'write'))


@pytest.mark.parametrize('strain', [0.015, 0.035, 0.05])
def test_launch_ends_where_the_element_puts_the_wall(strain):
    subject = Subject(CASE_II, settings_with(write={'start_strain': strain}))
    assert simulate_launch(subject, 'write') == pytest.approx(25.0, abs=0.3)


def test_actuator_rate_stretches_the_durations(case_ii):
    slow = Settings(actuator=ActuatorSettings(max_rate=1e-5))
    stretched = part((schedule,), CASE_II, slow)['durations'].values['step']
    assert case_ii['durations'].values['step'] == 4500.0
    assert stretched == pytest.approx(2 * 1.5 * 0.048 / 1e-5 + 600.0 + 1500.0)


def test_lowest_level_out_of_reach_is_named():
    """Without an actuator only kicks reach levels."""
    design, settings = load_element('kick_2').design_and_settings
    kick = replace(settings.kick, speeds=' '.join(settings.kick.speeds.split()[:2]) + ' 0 0')
    actuator = replace(settings.actuator, present=False)
    known = part((schedule,), design, replace(settings, kick=kick, actuator=actuator))
    assert known['durations'].verdict is Verdict.FAIL
    assert known['durations'].text.startswith('level 2 ')


def test_forecast_margin_is_that_of_the_device():
    element, wall = rig.pin(MemoryElement(CASE_II), 7), find_pinned_wall(CASE_II, 7)
    detector = element.transducer.fire_probe(End.LEFT)
    while detector.time < 1200.0:
        element.advance()
    echo = forecast_echo(CASE_II, wall, Settings().probe, End.LEFT, 0.5)
    assert echo.threshold_margin == pytest.approx(detector.threshold_margin, rel=0.05)


def test_register_is_not_judged_as_one_wall():
    """Its walls are sent by kicks, and are read by waveforms."""
    nibble = rig.first_levels('byte', 4)
    found = {finding.name for finding in check(*nibble.design_and_settings).findings}
    assert 'words' in found
    assert not found & {
        'launch_write', 'echo_left', 'apart', 'read_disturb', 'transducer_speed',
        'transducer_stroke',
    }  # fmt: skip


# --- carriers: they propagate in the phase of their end, and not in the other one --------------


def judge_carrier(end, omega, sigma=8.0, design=CASE_II):
    """Return the finding on a carrier of an end, by default of pulses of the paper's length."""
    name = 'probe' if end == 'left' else 'probe_right'
    settings = settings_with(**{name: {'omega_c': omega, 'sigma': sigma}})
    return part((material,), design, settings)[f'carrier_{end}']


@pytest.mark.parametrize(
    ('end', 'omega', 'verdict', 'reason'),
    [
        ('left', 2.10, Verdict.PASS, 'propagates in s2, and enough of it not in s1'),
        ('left', 2.03, Verdict.PASS, 'propagates in s2, and enough of it not in s1'),
        ('left', 2.00, Verdict.WARN, 'also propagates in s1'),
        ('left', 1.20, Verdict.WARN, 'also propagates in s1'),
        ('left', 2.16, Verdict.WARN, 'only the edge of the pulse propagates'),
        ('left', 0.60, Verdict.WARN, 'only the edge of the pulse propagates'),
        ('left', 0.50, Verdict.FAIL, 'is in the band of s1 alone'),
        ('left', 0.42, Verdict.FAIL, 'is in neither band'),
        ('left', 2.40, Verdict.FAIL, 'is in neither band'),
        ('right', 0.70, Verdict.PASS, 'propagates in s1, and enough of it not in s2'),
        ('right', 0.76, Verdict.PASS, 'propagates in s1, and enough of it not in s2'),
        ('right', 0.80, Verdict.WARN, 'also propagates in s2'),
        ('right', 0.42, Verdict.WARN, 'only the edge of the pulse propagates'),
        ('right', 2.40, Verdict.FAIL, 'is in neither band'),
    ],
)
def test_carrier_is_judged_by_the_bands_of_both_phases(end, omega, verdict, reason):
    """Up to a quarter of its bandwidth, 0.031, a carrier may lie within the other band."""
    found = judge_carrier(end, omega)
    assert found.verdict is verdict
    assert reason in found.text


@pytest.mark.parametrize(('end', 'omega'), [('left', 2.1), ('left', 0.74), ('right', 0.45)])
@pytest.mark.parametrize('sigma', [2.0, 8.0])
def test_share_of_a_pulse_is_its_energy_within_the_band(end, omega, sigma):
    """Of a Gaussian pulse the energy at a frequency falls as exp(-sigma^2 (w - omega)^2).

    Every cell of Case II passes the band: s2 before the wall at the left, s1 behind it.
    """
    low, high = {'left': (0.7688, 2.1318), 'right': (0.4689, 2.0500)}[end]
    w = np.linspace(omega - 5.0, omega + 5.0, 100_001)
    energy = np.exp(-((sigma * (w - omega)) ** 2))
    share = energy[(low < w) & (w < high)].sum() / energy.sum()
    said = re.search(r'(\d+)% of the pulse propagates', judge_carrier(end, omega, sigma).text)
    assert float(said[1]) / 100.0 == pytest.approx(share, abs=0.006)  # it is told in per cent


def test_pulse_much_wider_than_its_band_does_not_propagate():
    """Stiff cells pass 0.25 about 8.9; the pulse, a tenth of a time unit long, has 10."""
    stiff = replace(CASE_II, d=5.0, gamma=0.0, beta=-1e-3)
    found = judge_carrier('left', 8.93, sigma=0.1, design=stiff)
    assert found.verdict is Verdict.FAIL
    assert 'choose a larger sigma' in found.text


# --- the transducer: its force does the work that the element stores -----------------------------


def test_force_of_a_kick_does_the_work_that_is_stored():
    """The sum of force times speed of every step, without damping; first order in the step."""
    design, settings = load_element('kick_2').design_and_settings
    chain = Chain(replace(design, eta=1e-9), 0.05)
    kick = KickMotion(chain.end(1), design.D_s2, 0.1, replace(settings.kick, hold=0.0))
    before = energy(chain).total
    asked = transducer.simulate_kick(chain, kick)
    put_in = energy(chain).total - before
    assert asked['power'].sum() * chain.dt == pytest.approx(put_in, rel=0.01)
    assert asked['stroke'].max() == pytest.approx(design.D_s2 - design.D_s1, rel=1e-5)
    assert asked['speed'].max() == pytest.approx(0.1 * settings.kick.peak_speed_ratio, rel=1e-3)


def test_check_says_it_in_si_and_warns_of_what_is_not_made():
    design, settings = load_element('kick_2').design_and_settings
    found = part((transducer,), design, settings)
    assert found['transducer_stroke'].values['write'] == pytest.approx(
        settings.scale.length * (design.D_s2 - design.D_s1)
    )
    assert found['transducer_speed'].values['erase'] == pytest.approx(
        settings.scale.speed * settings.kick.peak_speed_ratio * settings.kick.erase_speed, rel=0.02
    )
    assert {each.verdict for each in found.findings} == {Verdict.PASS}
    slow = replace(settings, transducer=replace(settings.transducer, max_speed=0.3))
    found = part((transducer,), design, slow)
    assert found['transducer_speed'].verdict is Verdict.WARN
    assert 'it is not made' in found['transducer_speed'].text
    strained = replace(slow, write=replace(slow.write, method='strain'))  # it needs no kick
    found = part((transducer,), design, strained)
    assert found['transducer_speed'].verdict is Verdict.PASS


def test_force_contains_the_jump_at_the_end_of_a_late_kick():
    """A unit mass at the end of 3 x^2 - 2 x^3, x = (1 - l) s + l s^2 needs 6 D (1 + l)^2 / T^2.

    The spring to the next cell changes that by at most k_r D.
    """
    design, settings = load_element('robust_3').design_and_settings
    found = part((transducer,), design, settings)
    step, kick = design.D_s2 - design.D_s1, settings.kick
    duration = step / kick.wall_speeds[-1]
    jump = 6.0 * step * (1.0 + kick.late) ** 2 / duration**2
    force = found['transducer_force'].values['write'] / settings.scale.force
    assert force == pytest.approx(jump, abs=step)
