# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mov. S1: the walls moving under strain: write level 0 to 7, then erase."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem import Command, Erase, MemoryElement, Write
from mlmem.physics import CASE_II

from ...studies import style
from ...studies.trace import Trace, record_procedure
from ..figure import Data, Figure, Quality
from ..film import save_film

FIGURE = Figure('s1', 'Mov. S1: the walls moving under strain', seconds=13)


@FIGURE.register_data
def compute_data(quality: Quality) -> Data:
    """Return frames of configuration and strain while every level is written and erased."""
    design, element, trace = CASE_II, MemoryElement(CASE_II), Trace()
    captions: list[str] = []
    levels = range(quality.pick(2, design.levels))
    commands: dict[str, Command] = {
        f'write level {m}  ({design.code(m)})': Write(m) for m in levels
    }
    commands['erase: a kink meets the wall'] = Erase()
    for text, command in commands.items():
        record_procedure(element, command, trace)
        captions += [text] * (len(trace.t) - len(captions))
    frames = np.linspace(0, len(trace.t) - 1, quality.pick(8, 140)).astype(int)
    return {
        't': np.array(trace.t)[frames],
        'strain': np.array(trace.strain)[frames],
        'field': np.array(trace.configuration, dtype=np.float32)[frames],
        'caption': np.array(captions)[frames],
        'success': [outcome.success for outcome in trace.outcomes],
    }


@FIGURE.register_film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write the film over the strain; return the file."""
    return save_film(CASE_II, data, 1e3 * data['strain'], style.STRAIN_LABEL, stem)
