# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The element with equations and an integrator of its own, alone and behind an emulated rig."""

import dataclasses
import json
import subprocess

import numpy as np
import pytest
from rig.lines import TamperedLine, calibration, driven, emulated
from sampled import sampled

from mlmem import MemoryElement, Read, Settings, Write
from mlmem.instrument import drivers
from mlmem.instrument.end import Pulse
from mlmem.physics import CASE_II, NOH_BATHE, PEFRL, Chain, HeldCell, Scatter, Specimen, scattered
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.stepping import substep_times
from mlmem_lab.rk4 import Rk4Element
from mlmem_ros.ros.node_process import run_child_process
from mlmem_tools.rig.emulated import Sensors

DT = 0.25
PULSE = Settings().probe


def probed(element, samples=2400):
    """Fire the left pulse while the strain rises, and return the samples of both ends."""
    times = DT * np.arange(1, samples + 1)
    held = times[times <= 12 * PULSE.sigma]
    motion = Pulse(element.end(1), PULSE).at(held)
    return element.advance(1e-4 * times, HeldCell(1, motion))


@pytest.mark.parametrize(('method', 'relative'), sampled(
    [(PEFRL, False), (PEFRL, True), (NOH_BATHE, True)], lambda case: case[0] is PEFRL
))  # fmt: skip
def test_it_agrees_with_the_chain(method, relative):
    """An echo of another integrator, another interpolation: 1e-4 of the pulse."""
    parts = 4 if method is PEFRL else 40  # the one is of fourth order, the other of second
    made = scattered(CASE_II, Scatter(alpha=0.01, k_r=0.01, s=0.01, mass=0.003), 5)
    made = dataclasses.replace(made, damped_by_substrate=relative)
    ours = Rk4Element(made, DT, step=0.05)
    theirs = Chain(CASE_II, DT / parts, method)
    theirs.set_specimen(made)
    ours.v[:] = find_pinned_wall(made, 2)
    theirs.place(find_pinned_wall(made, 2))
    found = probed(ours)
    times = substep_times(2400 * parts, DT / parts, method)
    motion = Pulse(theirs.end(1), PULSE).at(times[times <= 12 * PULSE.sigma])
    expected = theirs.advance(1e-4 * times, HeldCell(1, motion))[:, parts - 1 :: parts]
    assert np.abs(expected - expected[:, :1]).max() > 5e-3  # it was probed
    assert found == pytest.approx(expected, abs=1e-6 if method is PEFRL else 2e-6)


@pytest.mark.parametrize(('push', 'slides'), [(0.9e-5, False), (1.1e-5, True)])
def test_dry_friction_holds_against_a_smaller_force(push, slides):
    """All cells are pushed alike: off their ground state by push / k_s1."""
    element = Rk4Element(Specimen(CASE_II), DT, friction=1e-5)
    uniform = Specimen(CASE_II, alpha_factor=1.0 / CASE_II.alpha)
    element.specimen = uniform
    element.v[:] = CASE_II.D_s1 + push / CASE_II.k_s1
    before = element.v.copy()
    element.advance(np.zeros(4000))
    moved = np.abs(element.v - before).max()
    assert moved > 1e-6 if slides else moved < 1e-12


def test_relative_damping_does_not_resist_the_substrate():
    """A cell far from the fixed end lags behind a ramp by eta V' / k_s1 if v is damped."""
    speed, lag = 1e-4, {}
    for relative in (False, True):
        element = Rk4Element(Specimen(CASE_II, damped_by_substrate=relative), DT)
        element.advance(speed * DT * np.arange(1, 10001))
        lag[relative] = element.V_N + CASE_II.D_s1 - element.end(CASE_II.N)
    expected = CASE_II.eta * speed / (CASE_II.k_s1 * CASE_II.alpha[-1])
    assert lag[False] - lag[True] == pytest.approx(expected, rel=0.1)


def test_a_device_writes_and_reads_it():
    """The factory calibration holds: the default method's steps of 0.25 delay it by 2.5."""
    element = Rk4Element(Specimen(CASE_II), DT)
    rig = emulated(element=element, sensors=Sensors(noise=1e-6, gain=(1.001, 0.999), seed=3))
    device = driven(TamperedLine(rig))
    assert device.perform(Write(1)).success
    reading = device.perform(Read()).reading
    assert reading.level == 1
    assert reading.delay == pytest.approx(device.calibration.left.delays[1], abs=4.0)


def test_the_command_tells_the_truth(tmp_path):
    """A rig in another process, as a fit will meet it."""
    truth = tmp_path / 'truth.json'
    options = ['rig', '--scatter', '1e-4', '--scatter-k-r', '2e-4', '--seed', '7', '--at-once']
    options += ['--truth', str(truth), '--integrator', 'rk4', '--friction', '1e-7']
    with run_child_process(
        'mlmem_tools.cli.main', options, stdout=subprocess.PIPE, text=True
    ) as process:
        address = process.stdout.readline().strip()
        told = json.loads(truth.read_text())
        expected = scattered(CASE_II, Scatter(alpha=1e-4, k_r=2e-4), 7)
        assert told['alpha'] == pytest.approx(expected.alpha, rel=1e-15)
        assert told['k_r'] == pytest.approx(expected.k_r, rel=1e-15)
        assert (told['seed'], told['friction']) == (7, 1e-7)
        settings = Settings()
        driver = drivers.open_driver('rig', f'{address}?patience=10', CASE_II, settings)
        element = MemoryElement(CASE_II, settings, calibration(), driver)
        assert element.perform(Read()).reading.level == -1
        driver.close()
