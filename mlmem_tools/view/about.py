# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a page needs to know about an element, from the node's public parameters alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np

from mlmem import Faults, Settings
from mlmem.physics import Design
from mlmem.physics.waves import pass_band
from mlmem.procedure_table import PROCEDURES
from mlmem.readers.words import Code
from mlmem.schema import find_descriptions
from mlmem.settings import ActuatorSettings, ScaleSettings
from mlmem_ros.host.settings import DESCRIPTION

FAULT_PARAMETERS = tuple(f'faults.{each.name}' for each in fields(Faults))

PAGE_PARAMETERS = (DESCRIPTION, *FAULT_PARAMETERS, 'time.speed')
"""Parameters of a node that a page needs."""


def describe_faults(values: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return every fault by name: its present `value`, `healthy` value, type and description."""
    return {
        field.name: {
            'value': values.get(field.name, field.default), 'healthy': field.default,
            'type': field.type, 'text': described.text, 'unit': described.unit,
            'low': described.low, 'high': described.high,
            'cell': getattr(described, 'cell', False), 'choices': described.choices,
        }
        for field, described in find_descriptions(Faults)
    }  # fmt: skip


def describe_kick(settings: Settings) -> dict[str, float] | None:
    """Return the speeds that a page offers for a kick by hand, `low` to `high`, and the `speed`
    with which it begins; None for an element without kicks.

    They reach beyond those of the levels and of the erase by a factor of 2, within the limit of
    the transducer.
    """
    kick = settings.kick
    if not (speeds := sorted(filter(None, kick.wall_speeds))):
        return None
    fastest = settings.transducer.max_speed / kick.peak_speed_ratio
    return {
        'low': 0.5 * speeds[0],
        'high': min(2.0 * max(speeds[-1], kick.erase_speed), fastest),
        'speed': speeds[len(speeds) // 2],
    }


@dataclass(frozen=True)
class About:
    """An element as a page shows it.

    Attributes:
        stride: Every stride-th cell is shown.
    """

    design: Design
    actuator: ActuatorSettings
    scale: ScaleSettings
    stride: int
    json: dict[str, Any]

    @property
    def phases(self) -> tuple[float, float]:
        """Configurations of the inactive and of the active phase."""
        return self.design.D_s1, self.design.D_s2

    @property
    def length(self) -> float:
        """Its length in metres: end displacement over strain."""
        return self.design.N * self.scale.length

    @classmethod
    def of(
        cls,
        design: Design,
        settings: Settings,
        node: str,
        parameters: Mapping[str, Any] | None = None,
    ) -> About:
        """Make one from an element.

        Args:
            design: The element as designed.
            settings: Settings of its instrument.
            node: Full name of the node.
            parameters: Those of a running node: its faults and speed.
        """
        present = parameters or {}
        faults = {
            each.removeprefix('faults.'): present[each]
            for each in FAULT_PARAMETERS
            if each in present
        }
        spacing = settings.register.spacing
        code = Code(design.levels, spacing) if spacing else None
        by_delays = not settings.compares_waveforms
        words = code.words if code else design.levels
        stride = math.ceil(design.N / 512)  # at most 512 cells are drawn
        probes = {'left': settings.probe, 'right': settings.probe_right}
        json = {
            'node': node,
            'cells': design.N,
            'rows': len(range(0, design.N, stride)),
            'stride': stride,
            'levels': design.levels,
            'words': words,
            'codes': [code.binary(n) if code else design.code(n) for n in range(words)],
            'code': code
            and {
                'tops': [b - a for a, b in pairwise((*code.each, code.words))],
                'spacing': spacing,
            },
            'defects': [design.defect_site(level) for level in range(design.levels)],
            'phases': [design.D_s1, design.D_s2],
            'springs': np.round(np.diff(design.strain_shape) * design.N, 4).tolist(),
            'substrate': design.substrate,
            'max_strain': settings.actuator.max_strain,
            'probes': {
                end: {
                    'threshold': probe.v_th if by_delays else None,
                    'gain': probe.gain_decay,
                }
                for end, probe in probes.items()
            },
            'bands': {'active': pass_band(design.k_s2), 'inactive': pass_band(design.k_s1)},
            'carriers': {end: probe.omega_c for end, probe in probes.items()}
            if by_delays
            else {'pulse': settings.register.omega_c},
            'faults': describe_faults(faults),
            'kick': describe_kick(settings),
            'procedures': {
                name: {
                    'takes': row.required_arguments,
                    'changes': row.changes,
                    'title': row.meaning,
                }
                for name, row in PROCEDURES.items()
            },
            'speed': present.get('time.speed', 1.0),
        }
        return cls(design, settings.actuator, settings.scale, stride, json)
