# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The books of the energy: they close where energy is kept, and only there.

======================  ============================================================
quantity                must agree with
======================  ============================================================
every entry             the functions of `physics.energy`, by the trapezoidal rule
state of a chain        that of `Chain.advance`, to the bit
work                    stored + heat: of the actuator, a pulse, a base, stuck cells
a wrong loop            an imbalance as large as the error
======================  ============================================================
"""

import dataclasses
from typing import NamedTuple

import numpy as np
import oracle
import pytest

from mlmem import Settings, Write, new_element
from mlmem.instrument.end import Move
from mlmem.instrument.motion import Ramp
from mlmem.physics import CASE_II, Chain, HeldCell, Specimen, substep_times
from mlmem.physics.energy import actuator_force, energy
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem_lab.paper.meter import MeteredChain, fit_meter
from mlmem_lab.studies.trace import Trace, record_procedure

SUBSTRATES = pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
SMALL = dataclasses.replace(CASE_II, N=60, eta=0.05)
DT, STEPS = 0.02, 1500


def resting(substrate='rigid', kind=MeteredChain):
    design = dataclasses.replace(SMALL, substrate=substrate)
    chain = kind(design, DT)
    chain.place(find_pinned_wall(Specimen(design), 0))
    return chain


class Budget(NamedTuple):
    """What a run gained, lost to the damping and was given, and what is stored after it."""

    gained: float
    heat: float
    actuator: float
    held: float
    shake: float
    stored: float

    @property
    def residual(self):
        return self.actuator + self.held + self.shake - self.gained - self.heat

    @property
    def imbalance(self):
        """The residual over all that was exchanged, without signs."""
        works = self.gained, self.actuator, self.held, self.shake
        return abs(self.residual) / max(self.heat + sum(map(abs, works)), 1e-9 * self.stored)


def audit(chain, V_N, held_cell=None, shake=None):
    """Advance a chain and return its budget."""
    before, shaken = chain.books(), chain.shake_work
    chain.advance(V_N, held_cell, shake)
    actuator, held, heat, gained = chain.books() - before
    return Budget(gained, heat, actuator, held, chain.shake_work - shaken, chain.books()[3])


def damping_power(chain):
    return chain.specimen.eta * np.sum(chain.velocity**2 + chain.substrate_velocity**2)


def dragging(chain, V_N):
    """Return what the damping of a rigid substrate takes in a step to V_N (Eq. 1b)."""
    velocity = (V_N - chain.V_N) / DT * chain.specimen.strain_shape
    return DT * chain.specimen.eta * np.sum(velocity**2)


RAMP = -0.05 * SMALL.N * oracle.smooth(substep_times(STEPS, DT) / 25.0)
STILL = np.zeros(2 * STEPS)


def pulse(home):
    t = substep_times(1400, DT)
    envelope = 0.1 * np.exp(-0.5 * ((t - 14.0) / 4.0) ** 2)
    sine, cosine = np.sin(1.4 * t), 1.4 * np.cos(1.4 * t)
    motion = np.array([home + envelope * sine, envelope * (cosine - sine * (t - 14.0) / 16.0)])
    return HeldCell(1, motion)


@SUBSTRATES
def test_a_step_is_booked_as_the_functions_of_the_energy_say(substrate):
    chain = resting(substrate)
    chain.advance(RAMP[:400])
    before = energy(chain).total, actuator_force(chain), damping_power(chain), chain.V_N
    drag = dragging(chain, RAMP[401]) if substrate == 'rigid' else 0.0
    budget = audit(chain, RAMP[400:402])
    after = energy(chain).total, actuator_force(chain), damping_power(chain), chain.V_N
    assert budget.gained == pytest.approx(after[0] - before[0], abs=1e-13 * after[0])
    assert budget.heat == pytest.approx(0.5 * DT * (before[2] + after[2]) + drag, rel=1e-12)
    mean = 0.5 * (before[1] + after[1])
    assert budget.actuator == pytest.approx(mean * (after[3] - before[3]) + drag, rel=1e-9)
    assert (budget.held, budget.shake) == (0.0, 0.0)


@SUBSTRATES
def test_a_metered_chain_has_the_same_bits(substrate):
    metered, plain = resting(substrate), resting(substrate, Chain)
    inputs = RAMP, pulse(plain.end(1)), 1e-3 * np.sin(substep_times(STEPS, DT))
    np.testing.assert_array_equal(metered.advance(*inputs), plain.advance(*inputs, STEPS))
    assert metered.state().tobytes() == plain.state().tobytes()
    assert (metered.V_N, metered.steps_done) == (plain.V_N, plain.steps_done)


@SUBSTRATES
def test_the_actuators_work_is_stored_or_heat(substrate):
    budget = audit(resting(substrate), RAMP)
    assert budget.heat > 0.5
    assert budget.actuator > 100.0
    assert abs(budget.residual) < 1e-4 * budget.heat  # second order: (omega dt)^2 / 12
    assert budget.imbalance < 1e-6


@SUBSTRATES
def test_the_pulses_work_is_stored_or_heat(substrate):
    chain = resting(substrate)
    budget = audit(chain, STILL, pulse(chain.end(1)))
    assert budget.held == pytest.approx(0.0478, abs=1e-3)
    assert budget.actuator == 0.0
    assert budget.imbalance < 3e-4


@SUBSTRATES
def test_the_work_of_a_shaken_base_is_stored_or_heat(substrate):
    shake = 0.02 * np.sin(0.5 * substep_times(STEPS, DT))
    budget = audit(resting(substrate), STILL, shake=shake)
    assert budget.shake > 0.01
    assert budget.imbalance < 1e-4


def test_what_holds_stuck_cells_works_too():
    """A base that moves under a heavy and a stuck cell, while the strain is ramped."""
    chain = resting()
    mass = np.ones(SMALL.N)
    mass[9] = 5.0
    chain.set_specimen(Specimen(chain.design, mass=mass, stuck=(41,)))
    shake = 0.02 * np.sin(0.5 * substep_times(STEPS, DT))
    budget = audit(chain, RAMP, pulse(chain.end(1)), shake)
    assert budget.heat > 0.1
    assert abs(budget.residual) < 1e-3 * budget.heat


class Wrong(Chain):
    """A chain whose loops see other parameters than its books."""

    damping, height = 1.0, 1.0

    def _build_cells(self):
        booked = self.specimen
        self.specimen = dataclasses.replace(booked, eta_factor=self.damping)
        super()._build_cells()
        self.specimen = booked
        height, *phase = self._cells.law
        self._cells = self._cells._replace(law=(self.height * height, *phase))


def test_wrong_damping_is_found():
    """Loops that damp three times as much as they should lose twice the heat that is booked."""
    wrong = type('Damped', (MeteredChain, Wrong), {'damping': 3.0})
    chain = resting(kind=wrong)
    budget = audit(chain, RAMP)
    assert budget.residual == pytest.approx(2.0 * chain.heat.sum(), rel=1e-3)
    chain = resting(kind=wrong)
    audit(chain, STILL, pulse(chain.end(1)))
    ringing = audit(chain, np.zeros(200))  # nothing works on it: gained = -3 heat
    assert ringing.imbalance == pytest.approx(0.5, abs=1e-3)


def test_a_wrong_potential_is_found():
    """Loops whose barrier is 2 % too high make 2 % too much heat of the on-site energy."""
    rough = 0.3 * np.random.default_rng(0).standard_normal(SMALL.N)

    def relaxed(kind):
        chain = resting(kind=kind)
        chain.place(chain.v + rough)
        parts = energy(chain)
        return audit(chain, STILL), parts.on_site - energy(chain).on_site

    assert relaxed(MeteredChain)[0].imbalance < 2e-4
    budget, released = relaxed(type('Stiff', (MeteredChain, Wrong), {'height': 1.02}))
    assert released > 0.03
    assert budget.residual == pytest.approx(-0.02 * released, rel=0.1)


def test_nothing_exchanged_is_no_imbalance():
    chain, plain = resting(), resting(kind=Chain)
    plain.rest(20_000)  # rounding is all that moves
    chain.restore(plain.state(), V_N=0.0, steps_done=20_000)
    assert audit(chain, STILL[:200]).imbalance < 1e-5


def launch(chain, duration=60.0):
    """Strain a chain in haste while its first cell is moved to the active phase, and let go."""
    times = substep_times(round(duration / chain.dt), chain.dt)
    V_N = Ramp(0.0, 0.04, 50.0).strain(times) * chain.design.N
    move = Move(chain.end(1), chain.design.D_s2, 0.05)
    held_cell = HeldCell(1, move.at(times[times <= move.duration]))
    return chain.advance(V_N, held_cell)


@SUBSTRATES
def test_what_goes_in_is_stored_or_dissipated(substrate):
    """The residual falls with the square of the step, as trapezoidal rule and integrator do."""
    design = dataclasses.replace(SMALL, substrate=substrate)
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
    assert record_procedure(element, Write(0), Trace()).success
    actuator, transducer, heat, stored = meter.books() - before
    assert transducer == pytest.approx(0.466, abs=0.005)  # most of a wall's energy, 0.484
    assert actuator + transducer == pytest.approx(heat + stored, rel=3e-3)
