# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The elements that are read: presets, designs, other steps, specimens with scatter or one bad
cell.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from mlmem_lab.designer import propose
from mlmem_ros.device import MemoryElement, Settings, new_element
from mlmem_ros.device.driver import Simulation, steps_per_tick
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.device.register import resting
from mlmem_ros.physics import INTEGRATORS, Chain, Design, Specimen
from mlmem_ros.physics.equilibrium import resting_wall
from mlmem_ros.physics.specimen import Scatter, scattered

SCATTER = {25: 8e-5, 9: 4e-3}
"""Scatter of alpha at which one step in a thousand fails, by cells per level (tolerance.md)."""

DESIGNED = 'levels_'
"""A design is named by this and its number of levels."""

REST = 3000.0
"""Time in which a wall that a bad cell moves comes to rest."""


@lru_cache(maxsize=2)
def known(name: str) -> tuple[Design, Settings]:
    """Return a preset, or the design for a number of levels such as `levels_24`."""
    if name in PRESETS:
        return PRESETS[name]
    found = propose(int(name.removeprefix(DESIGNED)))
    return found.design, found.settings


def made(name: str, finer: int = 1, specimen: int | None = None) -> MemoryElement:
    """Return a blank device.

    Args:
        name: As for `known`.
        finer: Number of steps in place of one of the device's.
        specimen: Number of a specimen with the scatter that its design stands; None for the ideal.
    """
    design, settings = known(name)
    steps = steps_per_tick(design, settings.time) * finer
    chain = Chain(design, settings.time.tick / steps, INTEGRATORS[settings.time.integrator])
    element = new_element(design, settings, driver=Simulation(chain))
    if specimen is not None:
        chain.set_specimen(scattered(design, Scatter(alpha=SCATTER.get(design.J, 0.0)), specimen))
    return element


def with_bad_cell(name: str, level: int, site: int, kind: str) -> MemoryElement:
    """Return a device with its wall at rest at a level, or -1 for blank, and one bad cell.

    `kind` is 'stuck', or a factor on the cell's alpha or mass such as 'alpha 0.3' or 'mass 3'.
    """
    element = made(name)
    design, chain = element.design, element.chain
    blank = np.full(design.N, design.D_s1)
    if element.register is not None:
        chain.place(resting(Specimen(design), element.register.code.walls(level)))
    else:
        chain.place(blank if level < 0 else resting_wall(Specimen(design), level))
    what, _, factor = kind.partition(' ')
    factors = np.ones(design.N)
    factors[site - 1] = float(factor or 1.0)
    alpha, mass = (factors, 1.0) if what == 'alpha' else (1.0, factors)
    stuck = () if factor else (site,)
    chain.set_specimen(Specimen(design, alpha_factor=alpha, mass=mass, stuck=stuck))
    chain.rest(math.ceil(REST / chain.dt))
    element.transducer.assume_rest()
    return element
