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
from mlmem.readers.register import forecast_ideal_words

from .paper.meter import fit_meter
from .results import run
from .words import draw_word

RANDOM_SEED = 1

WRITE_COUNT = 30

REST, DECODED = 25.0, 5
"""Lifetimes of waves that an element rests before it is read; reads whose decoding is timed."""

TIME_UNIT_S = 1e-4
"""Seconds of a time unit at the default scale, and joules of k_r a^2 in soft cells of 1 cm."""

REGISTER_PRESETS = ('case_2', 'byte', 'register_4', 'register_5')


def measure_costs(name: str) -> dict[str, float]:
    """Return what random writes in a row of a preset take, in the mean."""
    random = np.random.Generator(np.random.PCG64(RANDOM_SEED))
    element = new_element(preset(name))
    meter = fit_meter(element)
    count, bits, before = WRITE_COUNT, math.log2(element.reader.content_count), 0
    element.perform(Write(before))
    ticks, failed, heat = element.ticks, 0, float(meter.books()[2])
    for _ in range(count):
        while (word := draw_word(random, element.reader.content_count)) == before:
            pass
        failed += not element.perform(Write(word)).success
        before = word
    each = (element.ticks - ticks) / count
    energy = (float(meter.books()[2]) - heat) / count
    return {
        'writes': count,
        'failed': failed,
        'bits': bits,
        'ticks': each,
        'bits a second': bits / (each * element.tick * TIME_UNIT_S),
        'energy of a bit': energy / bits,
        'bits a joule': bits / (energy * TIME_UNIT_S),
        **_measure_reads(new_element(preset(name)), before),
    }


def _measure_reads(element: MemoryElement, content: int) -> dict[str, float]:
    """Return what reads of a content take."""
    failed = not element.perform(Write(content)).success
    for _ in range(math.ceil(REST / (element.design.eta * element.tick))):
        element.advance()
    reads = [element.perform(Read()) for _ in range(2)]
    found: dict[str, float] = {
        'reads failed': failed + sum(not read.success for read in reads),
        'ticks of a read': reads[0].ticks, 'of another': reads[1].ticks,
    }  # fmt: skip
    if element.reader.holds_words:
        found['listening'] = element.reader.read_duration(element) / element.tick
        found['seconds of decoding'] = min(_measure_decoding(element) for _ in range(DECODED))
    return found


def _measure_decoding(element: MemoryElement) -> float:
    """Return the seconds of the processor that decoding takes in a read."""
    forecasts, taken = forecast_ideal_words(element.design, element.settings), list[float]()
    decode = forecasts.decode

    def time_decoding(*heard: Any) -> Any:
        begin = time.thread_time()
        found = decode(*heard)
        taken.append(time.thread_time() - begin)
        return found

    with mock.patch.object(forecasts, 'decode', time_decoding):
        element.perform(Read())
    return taken[-1]


def merge_costs(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the costs of every preset, in one order."""
    presets = kept.get('presets', {}) | {name: found}
    return {'presets': {each: presets[each] for each in REGISTER_PRESETS if each in presets}}


if __name__ == '__main__':
    modules = ['lab/mlmem_lab/paper/meter.py', 'lab/mlmem_lab/words.py']
    sys.exit(
        run(
            'costs',
            __doc__,
            measure_costs,
            RANDOM_SEED,
            merge_costs,
            REGISTER_PRESETS,
            modules=modules,
        )
    )
