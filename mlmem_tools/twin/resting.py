# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the wall of an element can rest."""

from __future__ import annotations

from dataclasses import replace

from mlmem_ros.device.end import Shot
from mlmem_ros.physics import StateError, walls
from mlmem_ros.physics.potential import Array

from .forward import Forward

NEAR = 6.0
"""How far from where it is taken to be a wall may be, in cells."""


def equilibria(forward: Forward, shot: Shot, sites: Array) -> list[float]:
    """Return the positions at which a wall rests that is let go at any of some sites."""
    made = forward.specimen
    V = made.design.end_displacement(shot.strain) * made.strain_shape
    places: set[float] = set()
    for site in sites:
        try:
            v = forward.rest(replace(shot, wall=float(site)))
        except StateError:
            continue
        inside = walls(made.design, v - V)
        if len(inside) == 1:
            places.add(round(inside[0].position, 1))
    return sorted(places)
