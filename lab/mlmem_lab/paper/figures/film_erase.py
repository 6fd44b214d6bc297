# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: a film of an erase by a kink, from level 2."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem_ros.device import Erase, Write, new_element
from mlmem_ros.physics import CASE_II

from ...studies.trace import Trace, watch
from ..figure import Data, Figure, Quality
from ..film import save_walls

FIGURE = Figure(
    'erase',
    'An erase: a kink meets the wall',
    seconds=4,
)


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Return frames of configuration and strain while level 2 is erased."""
    element, trace = new_element(CASE_II), Trace()
    watch(element, Write(quality.pick(0, 2)), Trace())
    start = element.ticks
    success = watch(element, Erase(), trace).success
    frames = np.linspace(0, len(trace.t) - 1, quality.pick(6, 160)).astype(int)
    return {
        't': np.array(trace.t)[frames] - start * element.tick,
        'strain': np.array(trace.strain)[frames],
        'field': np.array(trace.configuration, dtype=np.float32)[frames],
        'caption': np.full(len(frames), 'an erase: a kink comes from the left and meets the wall'),
        'success': success,
    }


@FIGURE.film
def save(data: Data, stem: Path) -> list[Path]:
    """Write the film; return the file."""
    return save_walls(data, CASE_II, stem)
