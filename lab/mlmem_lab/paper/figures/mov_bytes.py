# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A film of a register: two bytes are written into the paper's element, then it is erased."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem import Command, Erase, Write, new_element, preset

from ...studies.trace import Trace, record_procedure
from ..figure import Data, Figure, Quality
from .mov_s1 import save_film

FIGURE = Figure('bytes', 'Film: two bytes in one element', seconds=20)

WRITTEN_WORDS = (0xA7, 0x5A)
"""Written in this order; most walls of the second are where the first has none."""


@FIGURE.data
def compute_data(quality: Quality) -> Data:
    """Return frames of the configuration while the words are written and erased."""
    element, trace = new_element(preset('byte')), Trace()
    captions: list[str] = []
    commands: dict[str, Command] = {
        f'write {word:#04x}: {word:08b}': Write(word)
        for word in WRITTEN_WORDS[: quality.pick(1, None)]
    }
    commands['erase: a loud pulse'] = Erase()
    for text, command in commands.items():
        record_procedure(element, command, trace)
        captions += [text] * (len(trace.t) - len(captions))
    frames = np.linspace(0, len(trace.t) - 1, quality.pick(8, 300)).astype(int)
    field = np.array(trace.configuration, dtype=np.float32)[frames]
    return {
        't': np.array(trace.t)[frames],
        'field': field,
        'caption': np.array(captions)[frames],
        'success': [outcome.success for outcome in trace.outcomes],
    }


@FIGURE.film
def save_movie(data: Data, stem: Path) -> list[Path]:
    """Write the cells over the motion of the first; return the file."""
    return [save_film(data, data['field'][:, 0], '$v_1$', stem, [f'bit {m}' for m in range(8)])]
