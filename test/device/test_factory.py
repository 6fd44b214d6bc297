# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The factory calibration, against the dispersion relation, and designs that cannot be read."""

import dataclasses

import numpy as np
import pytest

from mlmem import Read, Settings, SettingsError, factory_calibration, new_element
from mlmem.instrument.end import End
from mlmem.physics import CASE_II, Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.settings import ProbeSettings
from mlmem_tools.checks.echoes import forecast_echo

from . import rig


def group_velocity(omega, k_s):
    """Return d omega / d kappa of omega^2 = k_s + 2 - 2 cos(kappa), by a numerical derivative."""
    kappa = np.linspace(1e-3, np.pi - 1e-3, 20001)
    branch = np.sqrt(k_s + 2 - 2 * np.cos(kappa))
    return np.interp(omega, branch, np.gradient(branch, kappa))


@pytest.mark.parametrize('end', list(End))
def test_delays_are_those_of_linear_waves(end):
    """Another route to them: the equation of motion, linearised about the wall and solved for
    every frequency, without steps. Its samples are 0.25 apart, those of the device 0.5.
    """
    settings = Settings()
    delays = factory_calibration(CASE_II, settings).table(end).delays
    for level, delay in enumerate(delays):
        wall = find_pinned_wall(Specimen(CASE_II), level)
        exact = forecast_echo(CASE_II, wall, end.probe(settings), end, dt=0.0).delay
        assert delay == pytest.approx(exact, abs=1.5), level


def test_blank_element_echoes_from_its_far_end():
    """Later than the wall of level 0, by at most the flight to and from the 25 cells beyond."""
    right = factory_calibration(CASE_II, Settings()).right
    flight = 2 * 25 / group_velocity(0.7, 5.7867 * 0.0380)
    assert 0.3 * flight < right.blank - right.delays[0] < flight
    assert factory_calibration(CASE_II, Settings()).left.blank is None


def test_new_element_is_blank_and_at_rest_with_unknown_content():
    element = new_element(CASE_II)
    assert element.settings == Settings()
    assert element.calibration == factory_calibration(CASE_II, Settings())
    assert (element.reading, element.ticks, element.procedure) == (None, 0, '')
    start = element.chain.v.copy()
    assert rig.ticks(element, 50) == []
    np.testing.assert_allclose(element.chain.v, start, atol=1e-13)
    assert rig.wall(element) is None


@pytest.mark.parametrize('level', [0, 3, 7])
@pytest.mark.parametrize('end', list(End))
def test_every_level_reads_as_itself_to_bit(level, end):
    """The same wall, the same pulse: the delay of the table again."""
    element = rig.paper(level)
    reading = rig.succeed(element, Read(end))
    assert reading.level == level
    assert reading.delay == element.calibration.table(end).delays[level]
    assert reading.level_margin == 1.0


@pytest.mark.parametrize(
    ('design', 'probe', 'message'),
    [
        # 2.4, the printed carrier, lies above both pass bands: nothing comes back
        (CASE_II, ProbeSettings(omega_c=2.4), 'gives no echo at the left end'),
        # a threshold below the ring-down
        (CASE_II, ProbeSettings(v_th=1e-9), 'levels cannot be told apart'),
        # with beta > 0 a defect is a hill, not a hollow
        (dataclasses.replace(CASE_II, beta=0.3), ProbeSettings(), 'does not settle at level 0'),
    ],
)
def test_element_that_cannot_be_calibrated_is_rejected(design, probe, message):
    with pytest.raises(SettingsError, match=message):
        factory_calibration(design, Settings(probe=probe))
