# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scattered elements with what a fit knows of them, and as sensors show them whose gain is off;
each moves its end by what it measures.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlmem import (
    Driver,
    Event,
    Faults,
    MemoryElement,
    Outcome,
    SetFaults,
    SettingsError,
    load_element,
)
from mlmem.element_file import Element
from mlmem.factory import compute_calibration, factory_calibration
from mlmem.instrument.drivers import Simulation
from mlmem.physics import HeldCell, Specimen
from mlmem.physics.values import Array
from mlmem.procedure_table import Procedures
from mlmem_tools.identification.plan import plan_pulses
from mlmem_tools.rig.emulated import RigSensors

from ..rk4 import Rk4Element

TRANSDUCER_NOISE_CELLS = 1e-5
"""Standard deviation of a sample, in cells."""


class SensedSimulation(Simulation):
    """The package's own simulation, with sensors.

    Attributes:
        sensors: They may be exchanged at any time.
    """

    sensors = RigSensors()

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 1,
    ) -> Array:
        """Return the samples of both ends as the sensors give them; see `Driver.advance`."""
        if held_cell is not None:
            motion = self.sensors.held(held_cell.site, held_cell.motion)
            held_cell = replace(held_cell, motion=motion)
        return self.sensors.measure_ends(super().advance(V_N, held_cell, shake, ticks))

    def end(self, site: int) -> float:
        """Return the displacement of an end as its sensor gives it."""
        gain = self.sensors.gain[int(site > 1)]
        return gain * super().end(site)


class HiddenElement(Driver):
    """An element that is simulated otherwise, at the other end of a line as real ones are.

    Samples may be late by fractions of their time, and gains drift slowly.

    Attributes:
        element: What is behind the line; its samples are `PARTS` times as many.
    """

    PARTS = 4

    def __init__(
        self,
        element: Rk4Element,
        sensors: RigSensors,
        late: tuple[int, int],
        drift: float,
    ) -> None:
        """Put a line before an element.

        Args:
            sensors: They may be noisy, and off by a gain.
            late: By how many of the element's samples either sensor is late.
            drift: Greatest change of a gain, relative.
        """
        self.element, self._sensors, self._late = element, sensors, late
        self._drift = drift
        self.dt = self.PARTS * element.dt
        self.nodes = tuple((k + 1) / self.PARTS for k in range(self.PARTS))
        n = element.specimen.design.N
        self._past = np.repeat([[element.end(1)], [element.end(n)]], max(1, *late), axis=1)
        self._time = 0.0

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 1,
    ) -> Array:
        """Return the samples of both ends as the line gives them; see `Driver.advance`."""
        width, n = self._past.shape[1], len(V_N)
        gains = self._compute_gains(self._time + self.element.dt * np.arange(1.0, n + 1.0))
        if held_cell is not None:
            motion = self._sensors.held(held_cell.site, held_cell.motion)
            motion = motion / gains[int(held_cell.site > 1), : motion.shape[1]]
            held_cell = replace(held_cell, motion=motion)
        known = np.concatenate((self._past, self.element.advance(V_N, held_cell)), axis=1)
        heard = np.stack([
            gain * of_end[width - late : width - late + n]
            for gain, of_end, late in zip(gains, known, self._late, strict=True)
        ])  # fmt: skip
        self._past = known[:, -width:].copy()
        self._time += n * self.element.dt
        self.V_N = self.element.V_N
        return self._sensors.measure_ends(heard[:, self.PARTS - 1 :: self.PARTS])

    def end(self, site: int) -> float:
        """Return the displacement of an end as its sensor gives it."""
        row = int(site > 1)
        gain = self._sensors.gain[row] * float(self._compute_gains(np.array([self._time]))[row, 0])
        return gain * self.element.end(site)

    def _compute_gains(self, times: Array) -> Array:
        """Return the gains of both ends over those of the sensors, shape (2, n)."""
        period = 2e5  # of the drift in time units, four times that of a survey
        turns = times / period + np.array([[0.0], [0.25]])
        return np.asarray(1.0 + self._drift * np.sin(2.0 * np.pi * turns))


def fit_specimen(specimen: Specimen, seed: int) -> Element:
    """Return what a fit knows of it."""
    design = specimen.design
    # error of every alpha that a fit leaves, relative (s.d.): twice what fits of surveys have
    fit_alpha_error = 5e-4
    error = fit_alpha_error * np.random.default_rng(seed).standard_normal(design.N)
    known = replace(specimen, alpha_factor=specimen.alpha_factor * (1.0 + error))
    return Element(known, fit_alpha_error * known.alpha)


def build_device(name: str, specimen: Specimen) -> MemoryElement:
    """Return a device with this element and noisy transducers, as its factory calibrates it."""
    design, settings = load_element(name).design_and_settings
    chain = SensedSimulation.build_blank(specimen, settings.time).chain
    calibration = factory_calibration(design, settings)
    element = MemoryElement(design, settings, calibration, SensedSimulation(chain))
    element.apply(SetFaults(Faults(sensor_noise=TRANSDUCER_NOISE_CELLS)))
    return element


def load_forecast(name: str, element: MemoryElement, known: Element) -> None:
    """Give a device the forecast of a twin, as a node does: delays and planned pulses."""
    design, settings = load_element(name).design_and_settings
    try:
        delays = compute_calibration(known.timed_specimen, design, settings)
    except SettingsError:  # some level has no echo: those of the design
        delays = factory_calibration(design, settings)
    element.forecast = replace(
        delays, pulse_corrections=plan_pulses(known.specimen, load_element(name)).corrections
    )


def perform_command(element: MemoryElement, command: Procedures) -> tuple[Outcome, list[Event]]:
    """Perform a command; return its outcome, and the events of it."""
    run, events = element.apply(command), list[Event]()
    assert run is not None
    while run.outcome is None:
        events += element.advance(50)
    return run.outcome, events
