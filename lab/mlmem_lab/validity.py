# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the model of the memory ends: what it leaves out, tried on the presets.

The element is `Rk4Element`, changed in one way each; the device does not know.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mlmem import MemoryElement, Write, factory_calibration, load_element
from mlmem.physics import Design, Specimen, find_level

from .rk4 import Rk4Element
from .study import Study


@dataclass(frozen=True)
class Trial:
    """What a preset did.

    Attributes:
        way: What was changed; see `try_preset`.
        reached: Of the writes, how many put the wall where it belongs.
        read: Of these, how many the device knew to be right by their echo.
        writes: How many were asked for; by strain a failed one is the last.
    """

    preset: str
    way: str
    amount: float
    reached: int
    read: int
    writes: int

    @property
    def passed(self) -> bool:
        """Whether all was written and read."""
        return self.read == self.writes


def is_kicked(name: str) -> bool:
    """Whether a preset is written by kicks."""
    return load_element(name).settings.write.method == 'kick'


def try_amount(name: str, way: str, amount: float) -> Trial:
    """Write some levels of a preset, one attempt each, and return how that went."""
    design, settings = load_element(name).design_and_settings
    settings = replace(settings, write=replace(settings.write, attempts=1))
    known = factory_calibration(design, settings)
    element = MemoryElement(design, settings, known)
    body = _build_body(design, element.driver.dt, way, amount)
    element = MemoryElement(design, settings, known, body)
    # levels 0 to this are written by strain in turn, then 0 again: a step is like another. By
    # kicks all are, because each level has its own.
    highest_level = 3
    highest = design.levels - 1 if is_kicked(name) else min(highest_level, design.levels - 1)
    levels = [*range(highest + 1), 0]
    reached = read = 0
    for level in levels:
        outcome = element.perform(Write(level))
        found = body.v - body.V_N * body.specimen.strain_shape
        right = find_level(design, found) == level
        reached, read = reached + right, read + (right and outcome.success)
        if not (right and outcome.success) and not (is_kicked(name) and read):
            break
    return Trial(name, way, amount, reached, read, len(levels))


def _build_body(design: Design, dt: float, way: str, amount: float) -> Rk4Element:
    mass = np.ones(design.N)
    if way == 'end mass':
        mass[[0, -1]] = amount
    alpha = 1.0 - amount if way == 'softer' else 1.0
    friction = amount if way == 'friction' else 0.0
    relative = way == 'relative damping'
    specimen = Specimen(design, alpha_factor=alpha, mass=mass, damped_by_substrate=relative)
    return Rk4Element(specimen, dt, friction=friction)


def try_preset(name: str) -> list[Trial]:
    """Return how a preset fares in every way, up to the first amount at which a write by strain
    fails, or all by kicks do.

    The ways are damping of v - V; dry friction of a cell, in k_r cells; mass of both end cells,
    with their transducers; loss of alpha in all cells alike, as with a rising temperature.
    """
    found = []
    tried_amounts: dict[str, tuple[float, ...]] = {
        'relative damping': (1.0,),
        'friction': (1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5),
        'end mass': (1.2, 1.5, 2.0, 3.0),
        'softer': (0.001, 0.003, 0.01, 0.03, 0.1),
    }
    for way, amounts in tried_amounts.items():
        for amount in amounts:
            found.append(try_amount(name, way, amount))
            if not (found[-1].read if is_kicked(name) else found[-1].passed):
                break
    return found


validity_study = Study(
    'validity',
    try_preset,
    ('case_2', 'bits_2', 'bits_4', 'case_1', 'bits_1', 'kick_2', 'kick_4'),
    ('lab/mlmem_lab/validity.py', 'lab/mlmem_lab/rk4.py'),
)
