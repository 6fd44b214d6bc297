# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mov. S1: the walls moving under strain: write level 0 to 7, then erase."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem_ros.device import Command, Erase, Write, new_element
from mlmem_ros.physics import CASE_II

from ...studies.trace import Trace, watch
from ..figure import Data, Figure, Quality
from ..film import save_walls

FIGURE = Figure(
    's1',
    'Mov. S1: the walls moving under strain',
    seconds=13,
)


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return frames of configuration and strain while every level is written and erased."""
    design, element, trace = CASE_II, new_element(CASE_II), Trace()
    captions: list[str] = []
    levels = range(quality.pick(2, design.levels))
    commands: dict[str, Command] = {
        f'write level {m}  ({design.code(m)})': Write(m) for m in levels
    }
    commands['erase: a kink meets the wall'] = Erase()
    for text, command in commands.items():
        watch(element, command, trace)
        captions += [text] * (len(trace.t) - len(captions))
    frames = np.linspace(0, len(trace.t) - 1, quality.pick(8, 320)).astype(int)
    return {
        't': np.array(trace.t)[frames],
        'strain': np.array(trace.strain)[frames],
        'field': np.array(trace.configuration, dtype=np.float32)[frames],
        'caption': np.array(captions)[frames],
        'success': [outcome.success for outcome in trace.outcomes],
    }


@FIGURE.film
def save(data: Data, stem: Path) -> list[Path]:
    """Write the film; return the file."""
    return save_walls(data, CASE_II, stem)
