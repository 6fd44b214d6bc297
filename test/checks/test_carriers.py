# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The carriers of a pulse: they propagate in the phase of their end, and not in the other one."""

import dataclasses
import re

import numpy as np
import pytest

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem_tools.checks import Verdict, material
from mlmem_tools.checks.concern import Subject

BANDS = {'left': (0.7688, 2.1318), 'right': (0.4689, 2.0500)}
"""Of Case II where every cell passes: s2 before the wall at the left, s1 behind it."""


def judge_carrier(end, omega, sigma=8.0, design=CASE_II):
    """Return the finding on a carrier of an end, by default of pulses of the paper's length."""
    name, settings = 'probe' if end == 'left' else 'probe_right', Settings()
    probe = dataclasses.replace(getattr(settings, name), omega_c=omega, sigma=sigma)
    settings = dataclasses.replace(settings, **{name: probe})
    findings = material.check(Subject(design, settings))
    return next(each for each in findings if each.name == f'carrier_{end}')


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
    """Of a Gaussian pulse the energy at a frequency falls as exp(-sigma^2 (w - omega)^2)."""
    w = np.linspace(omega - 5.0, omega + 5.0, 100_001)
    energy, (low, high) = np.exp(-((sigma * (w - omega)) ** 2)), BANDS[end]
    share = energy[(low < w) & (w < high)].sum() / energy.sum()
    said = re.search(r'(\d+)% of the pulse propagates', judge_carrier(end, omega, sigma).text)
    assert float(said[1]) / 100.0 == pytest.approx(share, abs=0.006)  # it is told in per cent


def test_pulse_much_wider_than_its_band_does_not_propagate():
    """Stiff cells pass 0.25 about 8.9; the pulse, a tenth of a time unit long, has 10."""
    stiff = dataclasses.replace(CASE_II, d=5.0, gamma=0.0, beta=-1e-3)
    found = judge_carrier('left', 8.93, sigma=0.1, design=stiff)
    assert found.verdict is Verdict.FAIL
    assert 'choose a larger sigma' in found.text
