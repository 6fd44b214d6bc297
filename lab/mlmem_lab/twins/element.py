# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scattered elements, with what a fit knows of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlmem_ros.device import Event, Faults, MemoryElement, Outcome, SetFaults, SettingsError
from mlmem_ros.device.factory import calibration_of, factory_calibration
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.element_file import Element
from mlmem_ros.physics import Scatter, Specimen, scattered
from mlmem_ros.procedures import Procedures

from ..plans.plan import plan
from .sensed import SensedSimulation

KNOWN = 5e-4
"""Error of every alpha that a fit leaves, relative (s.d.): twice what fits of surveys have."""


def made(name: str, scatter: float, seed: int) -> Specimen:
    """Return an element of a preset whose alpha scatters."""
    return scattered(PRESETS[name].design, Scatter(alpha=scatter), seed)


def fitted(specimen: Specimen, seed: int) -> Element:
    """Return what a fit knows of it."""
    design = specimen.design
    error = KNOWN * np.random.default_rng(seed).standard_normal(design.N)
    known = replace(specimen, alpha_factor=specimen.alpha_factor * (1.0 + error))
    return Element(known, KNOWN * known.alpha)


def device(name: str, specimen: Specimen, noise: float = 0.0) -> MemoryElement:
    """Return a device with this element, as its factory calibrates it."""
    design, settings = PRESETS[name]
    chain = SensedSimulation.of(specimen, settings.time).chain
    calibration = factory_calibration(design, settings)
    element = MemoryElement(design, settings, calibration, SensedSimulation(chain))
    if noise:
        element.apply(SetFaults(Faults(sensor_noise=noise)))
    return element


def foretell(name: str, element: MemoryElement, known: Element) -> None:
    """Give a device the forecast of a twin, as a node does: delays and planned pulses."""
    design, settings = PRESETS[name]
    try:
        delays = calibration_of(known.timed, design, settings)
    except SettingsError:  # some level has no echo: those of the design
        delays = factory_calibration(design, settings)
    element.forecast = replace(delays, trims=plan(known.specimen, PRESETS[name]).trims)


def performed(element: MemoryElement, command: Procedures) -> tuple[Outcome, list[Event]]:
    """Perform a command; return its outcome, and the events of it."""
    run, events = element.apply(command), list[Event]()
    assert run is not None
    while run.outcome is None:
        events += element.advance(50)
    return run.outcome, events
