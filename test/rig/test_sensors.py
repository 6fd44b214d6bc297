# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an emulated rig measures with."""

import numpy as np
import pytest

from mlmem_ros.device import SettingsError
from mlmem_tools.rig.emulated import Sensors


def test_sensors_move_an_end_by_what_they_measure():
    sensors = Sensors(unit=0.5, zero=(3.0, -1.0), gain=(1.02, 0.99))
    true = np.array([[1.0, 1.5], [-2.0, 0.0]])
    read = sensors.readings(true)
    assert read[0] == pytest.approx(3.0 + 1.02 * true[0] / 0.5)
    held = sensors.held(225, np.stack((read[1], np.zeros(2))))
    assert held[0] == pytest.approx(true[1])
    noisy = Sensors(noise=1e-3, seed=1).readings(np.zeros((2, 4000)))
    assert noisy.std() == pytest.approx(1e-3, rel=0.05)
    ramp = np.tile(0.01 * np.arange(4000.0), (2, 1))
    late = Sensors(jitter=0.1, seed=1).readings(ramp) - ramp
    assert late.std() == pytest.approx(1e-3, rel=0.05)


@pytest.mark.parametrize('wrong', [{'noise': float('nan')}, {'gain': (1.0, 0.0)}])
def test_numbers_out_of_range_are_refused(wrong):
    with pytest.raises(SettingsError, match=r'must be .*; got'):
        Sensors(**wrong)
