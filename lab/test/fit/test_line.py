# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A survey over a line hears what a survey of the same element in process hears."""

import argparse

import numpy as np
import pytest
from rig.lines import ADDRESS, TamperedLine

from mlmem import MemoryElement, Shot, Survey, factory_calibration, load_element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, draw_specimen
from mlmem_lab.twins.sensed import perform_command
from mlmem_ros.rig import Rig
from mlmem_tools.cli.rig import _build_rig, rig

CHOSEN = load_element('bits_1')
SEED = 4711


def emulate_rig():
    """Return the rig of the page on fits, as `mlmem rig` makes it."""
    parser = argparse.ArgumentParser()
    for add in rig.options:
        add(parser)
    words = '--element', 'bits_1', '--scatter', '0.01', '--seed', str(SEED), '--at-once'
    return _build_rig(CHOSEN, parser.parse_args(words))


def survey(driver):
    """Return the shots of a survey."""
    calibration = factory_calibration(*CHOSEN.design_and_settings)
    element = MemoryElement(CHOSEN, calibration=calibration, driver=driver)
    outcome, events = perform_command(element, Survey())
    assert outcome.success
    return [event for event in events if isinstance(event, Shot)]


def test_shots_over_a_line_equal_those_in_process():
    """Procedures look later over a line, so other waves of what was before are left; all are below
    the least noise that a fit assumes, 1e-6 cells.
    """
    made = draw_specimen(CHOSEN.design, Scatter(alpha=0.01), SEED)
    heard = survey(Rig(*CHOSEN.design_and_settings, ADDRESS, TamperedLine(emulate_rig())))
    finer = round(Simulation.build_blank(made, CHOSEN.settings.time).dt / heard[0].dt)
    here = survey(Simulation.build_blank(made, CHOSEN.settings.time, finer))
    assert len(here) == len(heard)
    for there, ours in zip(heard, here, strict=True):
        assert np.std(there.samples - ours.samples) < 1e-6
        assert there.rest == pytest.approx(ours.rest, abs=1e-7)
