# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Probing: the helper of the figures, against the device that it stands for."""

import pytest

from mlmem import MemoryElement, Settings
from mlmem.instrument.echo import EchoDetector
from mlmem.instrument.end import End
from mlmem.physics import CASE_II
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem_lab.paper.echoes import record_echo


@pytest.mark.parametrize(('end', 'level'), [(End.LEFT, 0), (End.LEFT, 5), (End.RIGHT, 2)])
def test_probe_hears_what_the_device_was_calibrated_to(end, level):
    """A converged step, and the device's own: apart by three of its samples at most."""
    element = MemoryElement(CASE_II)
    probe = Settings().probe if end == 'left' else Settings().probe_right
    heard, dt = record_echo(CASE_II, find_pinned_wall(CASE_II, level), probe, end)
    detector = EchoDetector(probe, dt, filtered=True)
    detector.feed_displacements(heard)
    calibrated = element.calibration.table(end).delays[level]
    assert calibrated == pytest.approx(detector.build_echo(end).delay, abs=1.5)
