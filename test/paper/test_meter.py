# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The books of a chain: they change no bit of it, and they balance."""

import dataclasses

import numpy as np
import pytest

from mlmem_ros.device import Settings, Write, new_element
from mlmem_ros.device.motion import Ramp
from mlmem_ros.device.pulse import Move
from mlmem_ros.paper.meter import MeteredChain, fit_meter
from mlmem_ros.physics import CASE_II, Chain, Drive, substep_times
from mlmem_ros.studies.trace import Trace, watch

SMALL = dataclasses.replace(CASE_II, N=60)
SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])


def launch(chain, duration=60.0):
    """Strain a chain in haste while its first cell is moved to the active phase, and let go."""
    times = substep_times(round(duration / chain.dt), chain.dt)
    V_N = Ramp(0.0, 0.04, 50.0).strain(times) * chain.design.N
    move = Move(chain.end(1), chain.design.D_s2, 0.05)
    drive = Drive(1, move.at(times[times <= move.duration]))
    return chain.advance(V_N, drive)


@SUBSTRATES
def test_a_metered_chain_has_the_same_bits(substrate):
    design = dataclasses.replace(SMALL, substrate=substrate)
    plain, metered = Chain(design), MeteredChain(design)
    np.testing.assert_array_equal(launch(plain), launch(metered))
    np.testing.assert_array_equal(plain.state(), metered.state())
    assert (plain.V_N, plain.steps_done) == (metered.V_N, metered.steps_done)


@SUBSTRATES
def test_what_goes_in_is_stored_or_dissipated(substrate):
    """The residual falls with the square of the step, as trapezoidal rule and integrator do."""
    design = dataclasses.replace(SMALL, substrate=substrate, eta=0.05)
    residuals = []
    for dt in (0.03, 0.015):
        chain = MeteredChain(design, dt)
        before = chain.books()
        launch(chain)
        actuator, transducer, heat, stored = chain.books() - before
        assert transducer > 0.1
        assert heat > 0.1
        residuals.append(abs(actuator + transducer - heat - stored) / heat)
    assert residuals[0] < (1e-3 if substrate == 'rigid' else 1e-2)
    assert residuals[1] < residuals[0] / 1.8  # an end let go between two steps leaves first order


def test_the_heat_of_the_cells_is_the_damping_power_over_time():
    chain = MeteredChain(SMALL, 0.05)
    chain.place(np.where(SMALL.sites == 30, SMALL.D_s1 + 0.1, SMALL.D_s1))
    power = [0.0]  # it is let go
    for _ in range(200):
        chain.rest(1)
        power.append(SMALL.eta * np.sum(chain.velocity**2))
    assert chain.heat.sum() == pytest.approx(np.trapezoid(power, dx=0.05), rel=1e-12)
    assert chain.heat.argmax() == 29
    assert chain.actuator_work == chain.transducer_work == 0.0


def test_a_meter_sees_all_that_a_device_does():
    """A launch: the residual is that of the probe's pulse, which the integrator damps."""
    element = new_element(CASE_II, Settings())
    meter = fit_meter(element)
    before = meter.books()
    assert watch(element, Write(0), Trace()).success
    actuator, transducer, heat, stored = meter.books() - before
    assert transducer == pytest.approx(0.466, abs=0.005)  # most of a wall's energy, 0.484
    assert actuator + transducer == pytest.approx(heat + stored, rel=3e-3)
