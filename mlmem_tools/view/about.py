# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element as a page shows it, from the node's public parameters alone: what the page needs to
know about it, and its messages as the numbers of a picture.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem import Faults, Settings
from mlmem.physics import Design
from mlmem.physics.waves import pass_band
from mlmem.procedure_table import PROCEDURES
from mlmem.readers.words import Code
from mlmem.schema import find_descriptions
from mlmem_ros.contract import answers

ACTIVE_PHASE_COUNT = 8000
"""The active phase in a picture of integers; the inactive phase is 0."""


class About:
    """An element as a page shows it.

    Attributes:
        design: The element as designed.
        settings: Settings of its instrument.
        json: What the page needs to know about it.
    """

    def __init__(
        self, design: Design, settings: Settings, node: str, parameters: Mapping[str, Any] = {}
    ) -> None:
        """Take the full name of its node, and the `parameters` of a running one: its faults and
        speed.
        """
        self.design, self.settings = design, settings
        self._stride = math.ceil(design.N / 512)  # at most 512 cells are drawn
        spacing = settings.register.spacing
        code = Code(design.levels, spacing) if spacing else None
        by_delays = not settings.compares_waveforms
        words = code.words if code else design.levels
        probes = {'left': settings.probe, 'right': settings.probe_right}
        self.json: dict[str, Any] = {
            'node': node,
            'cells': design.N,
            'rows': len(range(0, design.N, self._stride)),
            'stride': self._stride,
            'levels': design.levels,
            'words': words,
            'codes': [code.format_binary(n) if code else design.code(n) for n in range(words)],
            'code': code
            and {
                'tops': [b - a for a, b in pairwise((*code.single_wall_words, code.words))],
                'spacing': spacing,
            },
            'defects': [design.defect_site(level) for level in range(design.levels)],
            'phases': [design.D_s1, design.D_s2],
            'springs': np.round(np.diff(design.strain_shape) * design.N, 4).tolist(),
            'substrate': design.substrate,
            'max_strain': settings.actuator.max_strain,
            'probes': {
                end: {'threshold': probe.v_th if by_delays else None, 'gain': probe.gain_decay}
                for end, probe in probes.items()
            },
            'bands': {'active': pass_band(design.k_s2), 'inactive': pass_band(design.k_s1)},
            'carriers': {end: probe.omega_c for end, probe in probes.items()}
            if by_delays
            else {'pulse': settings.register.omega_c},
            'faults': describe_faults(parameters),
            'kick': describe_kick(settings),
            'procedures': {
                name: {'takes': row.required_arguments, 'changes': row.changes,
                       'title': row.meaning}
                for name, row in PROCEDURES.items()
            },
            'speed': parameters.get('time.speed', 1.0),
        }  # fmt: skip

    def scale_field(self, message: Any) -> NDArray[np.int16]:
        """Return the configuration Delta_j of every shown cell as an integer: 0 inactive,
        `ACTIVE_PHASE_COUNT` active.

        Raises:
            ValueError: It is that of another element.
        """
        if len(message.data) != self.design.N:
            raise ValueError(f'data must have {self.design.N} cells')
        inactive, active = self.design.D_s1, self.design.D_s2
        shown = np.asarray(message.data, dtype=np.float32)[:: self._stride]
        scaled = (shown - inactive) * (ACTIVE_PHASE_COUNT / (active - inactive))
        return np.asarray(np.clip(np.nan_to_num(scaled), -32768, 32767), dtype=np.int16)

    def read_strain(self, message: Any) -> float:
        """Return the strain of the substrate from the joint states."""
        length = self.design.N * self.settings.scale.length
        return round(answers.parse_displacement(message) / length, 6)


def describe_faults(parameters: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return every fault by name: its present `value`, `healthy` value, type and description."""
    return {
        field.name: {
            'value': parameters.get(f'faults.{field.name}', field.default),
            'healthy': field.default,
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
