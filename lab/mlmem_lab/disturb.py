# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read disturb: the loudest pulse that moves nothing, over the loudest that is used.

Pulses of growing amplitude, a tenth louder each, are fired from rest at every level and at a blank
element, from either end: those of a read, which self-tests and `locate` use too, and those of a
survey. At the first that moves the wall the series ends.
"""

from __future__ import annotations

from typing import Any

from mlmem import End, preset
from mlmem.physics import Chain, Design, Specimen
from mlmem.procedure_table import BLANK
from mlmem.procedures import surveying
from mlmem.settings import ProbeSettings
from mlmem_tools.checks import check, disturb

from .study import Study

AMPLITUDE_STEPS = tuple(1.1**k for k in range(50))
"""Amplitudes over that of the pulse."""


def measure_ratios(name: str) -> dict[str, Any]:
    """Return the ratios of a preset: by end and level, the least ones, and the design check's."""
    design, settings = preset(name)
    chain = disturb.build_bare_chain(Specimen(design), settings.time)
    places = [BLANK, *range(design.levels)]
    ratios = {
        end: [
            _disturb_ratio(chain, level, end, end.probe(settings))
            for level in places[end is End.LEFT :]
        ]
        for end in End
    }
    forecast = check(design, settings)[disturb.FINDING_NAME].values
    return {
        **{f'read, {end}': min(of_levels) for end, of_levels in ratios.items()},
        'read, checked': min(forecast[end.value] / end.probe(settings).A for end in End),
        'survey': min(_disturb_ratio(chain, *shot) for shot in _list_shots(design)),
        **{f'by level, {end}': of_levels for end, of_levels in ratios.items()},
    }


def _list_shots(design: Design) -> list[tuple[int, End, ProbeSettings]]:
    """Return level, end and pulse of every shot of a survey."""
    levels = design.levels
    states = (
        (BLANK, surveying.BLANK_SHOTS),
        (0, surveying.FIRST_SHOTS),
        (levels // 2, surveying.MIDDLE_SHOTS),
        (levels - 1, surveying.LAST_SHOTS),
    )
    return [
        (
            level,
            aim.end,
            surveying.make_pulse(design, 0 if level == BLANK else design.defect_site(level), aim),
        )
        for level, aims in states
        for aim in aims
    ]


def _disturb_ratio(chain: Chain, level: int, end: End, probe: ProbeSettings) -> float:
    """Return the loudest pulse that moves nothing over one as loud as it is used."""
    return round(disturb.find_safe_limit(chain, [level], end, probe, AMPLITUDE_STEPS) / probe.A, 2)


STUDY = Study(
    'disturb',
    measure_ratios,
    ('kick_2', 'case_1', 'case_2', 'bits_1', 'bits_2'),
    ('lab/mlmem_lab/disturb.py',),
)
