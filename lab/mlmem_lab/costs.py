# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bit costs: python3 -m mlmem_lab.costs [PRESET ...] makes lab/results/costs.json.

Random contents are written one after another, each verified as always, while the chain keeps the
books of its energy. A bit is one of log2 of the number of contents; its energy is what becomes
heat of a write, in k_r (lattice constant)^2. Strain that is borrowed and returned costs nothing.
Then it is read at rest, and once more at once: the waves of the first pulse have to fade. The
processor time of decoding is that of one thread (OPENBLAS_NUM_THREADS=1), the least of some.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Mapping
from typing import Any
from unittest import mock

import numpy as np

from mlmem import MemoryElement, Read, Write, new_element, preset

from .paper.meter import fit_meter
from .results import run
from .words import drawn

SEED = 1

WRITES = 30

REST, DECODED = 25.0, 5
"""Lifetimes of waves that an element rests before it is read; reads whose decoding is timed."""

UNIT = 1e-4
"""Seconds of a time unit at the default scale, and joules of k_r a^2 in soft cells of 1 cm."""

REGISTERS = ('case_2', 'byte', 'register_4', 'register_5')


def measured(name: str) -> dict[str, float]:
    """Return what random writes in a row of a preset take, in the mean."""
    random = np.random.Generator(np.random.PCG64(SEED))
    element = new_element(preset(name))
    meter = fit_meter(element)
    count, bits, before = WRITES, math.log2(element.words), 0
    element.perform(Write(before))
    ticks, failed, heat = element.ticks, 0, float(meter.books()[2])
    for _ in range(count):
        while (word := drawn(random, element.words)) == before:
            pass
        failed += not element.perform(Write(word)).success
        before = word
    each = (element.ticks - ticks) / count
    energy = (float(meter.books()[2]) - heat) / count
    return {
        'writes': count, 'failed': failed, 'bits': bits, 'ticks': each,
        'bits a second': bits / (each * element.tick * UNIT), 'energy of a bit': energy / bits,
        'bits a joule': bits / (energy * UNIT), **_reads(new_element(preset(name)), before),
    }  # fmt: skip


def _reads(element: MemoryElement, content: int) -> dict[str, float]:
    """Return what reads of a content take."""
    failed = not element.perform(Write(content)).success
    for _ in range(math.ceil(REST / (element.design.eta * element.tick))):
        element.advance()
    reads = [element.perform(Read()) for _ in range(2)]
    found: dict[str, float] = {
        'reads failed': failed + sum(not read.success for read in reads),
        'ticks of a read': reads[0].ticks, 'of another': reads[1].ticks,
    }  # fmt: skip
    if (reader := element.register) is not None:
        found['listening'] = reader.listener.ticks
        found['seconds of decoding'] = min(_decoding(element) for _ in range(DECODED))
    return found


def _decoding(element: MemoryElement) -> float:
    """Return the seconds of the processor that decoding takes in a read."""
    reader, taken = element.register, list[float]()
    assert reader is not None
    decode = reader.decode

    def timed(*heard: Any) -> Any:
        begin = time.thread_time()
        found = decode(*heard)
        taken.append(time.thread_time() - begin)
        return found

    with mock.patch.object(reader, 'decode', timed):
        element.perform(Read())
    return taken[-1]


def joined(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the costs of every preset, in one order."""
    presets = kept.get('presets', {}) | {name: found}
    return {'presets': {each: presets[each] for each in REGISTERS if each in presets}}


if __name__ == '__main__':
    modules = ['lab/mlmem_lab/paper/meter.py', 'lab/mlmem_lab/words.py']
    sys.exit(run('costs', __doc__, measured, SEED, joined, REGISTERS, modules=modules))
