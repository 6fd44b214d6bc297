# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Watching and probing: the helpers of the figures, against the device that they stand for."""

import dataclasses

import numpy as np
import pytest

from mlmem import MemoryElement, Settings
from mlmem.instrument.end import End
from mlmem.instrument.motion import Cycle
from mlmem.move_settings import CycleSettings
from mlmem.physics import CASE_II, NOH_BATHE, Chain, Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.echo import EchoDetector
from mlmem_lab.paper.echoes import record_echo
from mlmem_lab.studies.trace import strain_chain


@pytest.mark.parametrize('every', [7.0, 100.0, 500.0, 5000.0])
def test_a_schedule_takes_its_time_whatever_the_looks(every):
    chain = Chain(dataclasses.replace(CASE_II, N=40), integrator=NOH_BATHE)
    times = CycleSettings(ramp=120.0, hold=60.0, release=100.0, settle=30.0)
    trace = strain_chain(chain, Cycle.plan_cycle(times, -0.02), every)
    assert trace.t[-1] == pytest.approx(310.0, rel=0.02)
    assert chain.time == pytest.approx(trace.t[-1])
    assert min(trace.strain) == pytest.approx(-0.02)
    assert trace.strain[-1] == 0.0
    assert np.diff(trace.t).max() <= every + 1e-9 if len(trace.t) > 1 else True


@pytest.mark.parametrize(('end', 'level'), [(End.LEFT, 0), (End.LEFT, 5), (End.RIGHT, 2)])
def test_a_probe_hears_what_the_device_was_calibrated_to(end, level):
    """A converged step, and the device's own: apart by three of its samples at most."""
    element = MemoryElement(CASE_II)
    probe = Settings().probe if end == 'left' else Settings().probe_right
    heard, dt = record_echo(CASE_II, find_pinned_wall(Specimen(CASE_II), level), probe, end)
    detector = EchoDetector(probe, dt, filtered=True)
    detector.feed(heard)
    calibrated = element.calibration.table(end).delays[level]
    assert calibrated == pytest.approx(detector.echo(end).delay, abs=1.5)
