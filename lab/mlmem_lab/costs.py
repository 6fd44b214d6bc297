# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bit costs: python3 -m mlmem_lab.costs [PRESET ...] makes lab/results/costs.json.

Random contents are written one after another, each verified as always, while the chain keeps the
books of its energy. A bit is one of log2 of the number of contents; its energy is what becomes
heat of a write, in k_r (lattice constant)^2. Strain that is borrowed and returned costs nothing.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from mlmem_ros.device import Write, new_element, preset

from .paper.meter import fit_meter
from .results import run
from .words import drawn

SEED = 1

WRITES = {'register_8': 10}
"""Those of others are `MANY`; in register_8 each takes minutes of a processor."""

MANY = 30

UNIT = 1e-4
"""Seconds of a time unit at the default scale, and joules of k_r a^2 in soft cells of 1 cm."""

REGISTERS = ('case_2', 'kick_3', 'byte', 'register_4', 'register_5', 'register_8')


def measured(name: str) -> dict[str, float]:
    """Return what random writes in a row of a preset take, in the mean."""
    random = np.random.Generator(np.random.PCG64(SEED))
    element = new_element(preset(name))
    meter = fit_meter(element)
    count, bits, before = WRITES.get(name, MANY), math.log2(element.words), 0
    element.perform(Write(before))
    ticks, failed, heat = element.ticks, 0, float(meter.books()[2])
    for _ in range(count):
        while (word := drawn(random, element.words)) == before:
            pass
        failed += not element.perform(Write(word)).success
        before = word
    time = (element.ticks - ticks) / count * element.tick
    energy = (float(meter.books()[2]) - heat) / count
    return {
        'writes': count, 'failed': failed, 'bits': bits, 'ticks': (element.ticks - ticks) / count,
        'bits a second': bits / (time * UNIT), 'energy of a bit': energy / bits,
        'bits a joule': bits / (energy * UNIT),
    }  # fmt: skip


def joined(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the costs of every preset, in one order."""
    presets = kept.get('presets', {}) | {name: found}
    return {'presets': {each: presets[each] for each in REGISTERS if each in presets}}


if __name__ == '__main__':
    entries = {name: [name] for name in REGISTERS}
    sys.exit(run('costs', __doc__, measured, SEED, joined, entries))
