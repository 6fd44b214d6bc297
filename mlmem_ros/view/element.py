# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a page needs to know about an element, from the node's public parameters alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..device import Faults
from ..device.settings import ActuatorSettings
from ..physics import Design

ROWS = 512
"""Most cells in a picture; of a longer chain every second, third ... one is shown."""

FAULTS = tuple(f'faults.{each.name}' for each in fields(Faults))

WANTED = (
    *(f'design.{each.name}' for each in fields(Design)),
    *FAULTS,
    'actuator.max_strain',
    'actuator.max_rate',
    'actuator.hand_rate',
    'probe.v_th',
    'probe.gain_decay',
    'probe_right.v_th',
    'probe_right.gain_decay',
    'scale.time',
    'scale.length',
    'time.tick',
    'time.speed',
)
"""Parameters that a page needs."""


@dataclass(frozen=True)
class Element:
    """An element as a page shows it.

    Attributes:
        design: The element.
        stride: Every stride-th cell is shown.
        about: What the page gets, ready for JSON.
    """

    design: Design
    stride: int
    about: dict[str, Any]

    @property
    def phases(self) -> tuple[float, float]:
        """Configurations of the inactive and of the active phase."""
        return self.design.D_s1, self.design.D_s2

    @property
    def length(self) -> float:
        """Its length in metres: end displacement over strain."""
        return float(self.design.N * self.about['scale']['length'])

    @classmethod
    def of(cls, parameters: Mapping[str, Any], node: str) -> Element:
        """Make one from parameters; those that are missing have their defaults.

        Args:
            parameters: Values by the names of the node's parameters.
            node: Full name of the node.

        Raises:
            DesignError: They do not describe an element. TypeError: The design is not given.
        """
        given = {
            each.name: parameters[f'design.{each.name}']
            for each in fields(Design)
            if f'design.{each.name}' in parameters
        }
        design = Design(**given)
        scale = {'time': 1e-4, 'length': 0.01}
        scale |= {name: float(parameters.get(f'scale.{name}', scale[name])) for name in scale}
        stride = math.ceil(design.N / ROWS)
        about = {
            'node': node,
            'cells': design.N,
            'rows': len(range(0, design.N, stride)),
            'stride': stride,
            'levels': design.levels,
            'codes': [design.code(level) for level in range(design.levels)],
            'defects': [design.defect(level) for level in range(design.levels)],
            'phases': [design.D_s1, design.D_s2],
            'springs': np.round(np.diff(design.strain_shape) * design.N, 4).tolist(),
            'substrate': design.substrate,
            'max_strain': float(parameters.get('actuator.max_strain', 0.08)),
            'hand_rate': ActuatorSettings(
                max_rate=float(parameters.get('actuator.max_rate', 1e-4)),
                hand_rate=float(parameters.get('actuator.hand_rate', 0.0)),
            ).by_hand,
            'scale': scale,
            'tick': float(parameters.get('time.tick', 20.0)) * scale['time'],
            'speed': float(parameters.get('time.speed', 1.0)),
            'probes': {
                end: {
                    'threshold': float(parameters.get(f'{group}.v_th', 0.0)),
                    'gain': float(parameters.get(f'{group}.gain_decay', 0.0)),
                }
                for end, group in (('left', 'probe'), ('right', 'probe_right'))
            },
            'faults': {
                name.partition('.')[2]: parameters[name] for name in FAULTS if name in parameters
            },
        }
        return cls(design, stride, about)
