# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Watching and probing: the helpers of the figures, against the device that they stand for."""

import dataclasses

import numpy as np
import pytest

from mlmem import MemoryElement, Settings, Write
from mlmem.instrument.end import End
from mlmem.instrument.motion import Cycle
from mlmem.move_settings import CycleSettings, WriteSettings
from mlmem.physics import CASE_II, Chain, Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.echo import EchoDetector
from mlmem_lab.paper.echoes import (
    PAPER_PROBE,
    PRINTED_PROBE,
    detect_echo,
    probe_element,
    record_echo,
    without_wall,
)
from mlmem_lab.studies.trace import Trace, record_procedure, strain_chain, wall_path


@pytest.mark.parametrize('every', [7.0, 100.0, 500.0, 5000.0])
def test_a_schedule_takes_its_time_whatever_the_looks(every):
    chain = Chain(dataclasses.replace(CASE_II, N=40))
    times = CycleSettings(ramp=120.0, hold=60.0, release=100.0, settle=30.0)
    trace = strain_chain(chain, Cycle.plan_cycle(times, -0.02), every)
    assert trace.t[-1] == pytest.approx(310.0, rel=0.02)
    assert chain.time == pytest.approx(trace.t[-1])
    assert min(trace.strain) == pytest.approx(-0.02)
    assert trace.strain[-1] == 0.0
    assert np.diff(trace.t).max() <= every + 1e-9 if len(trace.t) > 1 else True


def test_a_schedule_ends_where_the_device_ends():
    element = MemoryElement(CASE_II)
    record_procedure(element, Write(0), Trace())
    trace = Trace()
    outcome = record_procedure(element, Write(1), trace)
    assert outcome.success
    chain = Chain(CASE_II)
    chain.place(find_pinned_wall(Specimen(CASE_II), 0))
    cycle = Cycle.plan_cycle(CycleSettings(), WriteSettings().compression)
    own = strain_chain(chain, cycle, 20.0)
    device, bare = (wall_path(CASE_II, t.configuration) for t in (trace, own))
    assert np.nanmax(np.abs(device[: len(bare) // 3] - bare[: len(bare) // 3])) < 2.0
    assert device[-1] == pytest.approx(50.0, abs=0.1)
    assert bare[-1] == pytest.approx(50.0, abs=0.3)


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


@pytest.mark.parametrize('end', list(End))
def test_an_endless_element_is_silent_and_begins_like_the_real_one(end):
    probe = PAPER_PROBE if end == 'left' else Settings().probe_right
    silence, dt = without_wall(CASE_II, probe, end, 600.0)
    assert detect_echo(silence, dt, probe, end).delay is None
    level = 7 if end == 'left' else 0
    real = probe_element(CASE_II, find_pinned_wall(Specimen(CASE_II), level), probe, end, 600.0)
    before = real.t < 300.0
    assert np.abs(np.abs(silence[: len(real.v_m)]) - real.v_m)[before].max() < 1e-5
    assert real.v_m.max() > 5e-3


def test_the_printed_detector_is_deaf():
    assert (PRINTED_PROBE.omega_c, PRINTED_PROBE.v_th) == (2.4, 7.5e-3)
    for level in (0, 7):
        assert (
            probe_element(CASE_II, find_pinned_wall(Specimen(CASE_II), level), PRINTED_PROBE).delay
            is None
        )
