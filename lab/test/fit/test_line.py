# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A survey over a line hears what a survey of the same element in process hears."""

import argparse
from dataclasses import replace

import numpy as np
import pytest
from rig.lines import ADDRESS, TamperedLine

from mlmem import MemoryElement, Shot, Survey, factory_calibration, preset
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, scattered
from mlmem_lab.fit.fit import rank_places
from mlmem_lab.fit.misfit import WHOLE_WINDOW, Misfit
from mlmem_lab.twins.sensed import perform_command
from mlmem_ros.rig import Rig
from mlmem_tools.cli.rig import _build_rig, rig
from mlmem_tools.twin.noise import MIN_NOISE_CELLS
from mlmem_tools.twin.unknowns import Unknowns

CHOSEN = preset('bits_1')
SEED = 4711


def served():
    """Return the rig of the page on fits, as `mlmem rig` makes it, and its truth."""
    parser = argparse.ArgumentParser()
    for add in rig.options:
        add(parser)
    words = '--element', 'bits_1', '--scatter', '0.01', '--seed', str(SEED), '--at-once'
    return _build_rig(CHOSEN, parser.parse_args(words))


def surveyed(driver):
    """Return the shots of a survey."""
    calibration = factory_calibration(*CHOSEN)
    outcome, events = perform_command(MemoryElement(*CHOSEN, calibration, driver), Survey())
    assert outcome.success
    return [event for event in events if isinstance(event, Shot)]


@pytest.fixture(scope='module')
def shots():
    """What comes over the line, and the true alpha."""
    emulated, truth = served()
    return surveyed(Rig(*CHOSEN, ADDRESS, TamperedLine(emulated))), np.array(truth['alpha'])


def test_every_shot_is_that_of_the_element_in_process(shots):
    """Procedures look later over a line, so other waves of what was before are left; all are below
    the least noise that a fit assumes.
    """
    made = scattered(CHOSEN.design, Scatter(alpha=0.01), SEED)
    finer = round(Simulation.of(made, CHOSEN.settings.time).dt / shots[0][0].dt)
    here = surveyed(Simulation.of(made, CHOSEN.settings.time, finer))
    assert len(here) == len(shots[0])
    for there, ours in zip(shots[0], here, strict=True):
        assert np.std(there.samples - ours.samples) < MIN_NOISE_CELLS
        assert there.rest == pytest.approx(ours.rest, abs=1e-7)


def test_the_true_element_explains_every_shot(shots):
    """Without being told how the rig computes its element: a real one has no step."""
    heard, alpha = shots
    unknowns = Unknowns(CHOSEN.design)
    x = unknowns.mean
    x[unknowns.alpha] = alpha
    misfit = Misfit(unknowns, heard)
    for wall in {shot.wall for shot in heard}:
        same = [shot for shot in heard if shot.wall == wall]
        place = rank_places(misfit, x, same)[0] if wall else 0.0
        for shot in same:
            moved = replace(shot, wall=place)
            assert np.mean(misfit.residuals(x, moved, WHOLE_WINDOW)[0] ** 2) < 1.0
