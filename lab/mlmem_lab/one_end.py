# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count what becomes of reads when one end is wrong, over presets, levels and `read.end`.

Every level is probed once with its wall at rest. The echo of one end is then spoiled: late or
early, on another clock, louder or weaker, silent, or behind a burst; the other one's is as it was.
Reads with eight times the damping are probed anew.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mlmem import Faults, MemoryElement, Read, SetFaults, preset
from mlmem.commands import EchoReceived
from mlmem.instrument.end import End
from mlmem.physics import Specimen
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.decoding import decode_echoes
from mlmem.readers.echo import Echo, blanking_time, detection_threshold
from mlmem.readers.reading import UNDECODABLE

from .results import STRAINED_PRESETS
from .study import Study, sum_counts

SEED, DRAWS = 1, 8
"""Of all chance; of every error, level and end."""

READ_ENDS = ('left', 'right', 'both')
"""Settings of `read.end`."""


Spoil = Callable[[np.random.Generator, Echo], Echo]


def replace_signal(echo: Echo, v_c: np.ndarray) -> Echo:
    """Return an echo whose v_c is another one."""
    ratio = np.where(
        echo.t > blanking_time(echo.probe), v_c / detection_threshold(echo.probe, echo.t), 0.0
    )
    over = ratio > 1.0
    delay = float(echo.t[over.argmax()]) if over.any() else None
    return replace(echo, v_c=v_c, v_m=v_c, delay=delay, threshold_margin=float(ratio.max()))


def shift_echo(random: np.random.Generator, echo: Echo) -> Echo:
    """Return it up to 60 time units late or early."""
    by = random.uniform(-60.0, 60.0)
    return replace_signal(echo, np.interp(echo.t - by, echo.t, echo.v_c, right=0.0))


def scale_clock(random: np.random.Generator, echo: Echo) -> Echo:
    """Return it on a clock that is up to 20 % fast or slow."""
    rate = random.uniform(0.8, 1.2)
    return replace_signal(echo, np.interp(echo.t * rate, echo.t, echo.v_c, right=0.0))


def scale_gain(random: np.random.Generator, echo: Echo) -> Echo:
    """Return it up to 20 times weaker or louder."""
    return replace_signal(echo, echo.v_c * 20.0 ** random.uniform(-1.0, 1.0))


def add_burst(random: np.random.Generator, echo: Echo) -> Echo:
    """Return it with something as loud as an echo before or after."""
    at, loud = random.uniform(60.0, echo.t[-1]), random.uniform(1.5, 15.0)
    bump = loud * np.exp(-((echo.t - at) ** 2) / 200.0) * detection_threshold(echo.probe, echo.t)
    return replace_signal(echo, np.maximum(echo.v_c, bump))


def silence_echo(random: np.random.Generator, echo: Echo) -> Echo:
    """Return nothing."""
    return replace_signal(echo, np.zeros_like(echo.v_c))


ECHO_FAULTS: dict[str, Spoil] = {
    'late or early': shift_echo,
    'clock': scale_clock,
    'gain': scale_gain,
    'burst': add_burst,
    'silence': silence_echo,
}


def record_echoes(element: MemoryElement, level: int, faults: Faults) -> dict[End, Echo]:
    """Return the echoes of a wall at rest at a level."""
    element.apply(SetFaults(Faults()))
    element.chain.place(find_pinned_wall(Specimen(element.design), level))
    element.transducer.assume_equilibrium()
    element.apply(SetFaults(faults))
    element.apply(Read())
    found: dict[End, Echo] = {}
    while True:
        for event in element.advance(1000):
            if isinstance(event, EchoReceived):
                found[event.echo.end] = event.echo
        if not element.procedure:
            return found


def count_reads(name: str) -> dict[str, Counter[str]]:
    """Return how the reads of a preset ended, by what was wrong and `read.end`."""
    design, settings = preset(name)
    element, found = MemoryElement(preset(name)), dict[str, Counter[str]]()
    random = np.random.Generator(np.random.PCG64(SEED))
    step = max(1, design.levels // 32)
    end_phases = (1, 0)  # of the ends of an element that stores a level
    for level in range(0, design.levels, step):
        sound = record_echoes(element, level, Faults())
        weak = record_echoes(element, level, Faults(damping_factor=8.0))
        for names in READ_ENDS:
            read = replace(settings.read, end=names)

            tried = [('sound', sound), ('damping x 8', weak)]
            tried += [
                (what, {**sound, end: spoil(random, sound[end])})
                for what, spoil in ECHO_FAULTS.items()
                for end in End
                for _ in range(DRAWS)
            ]
            for what, echoes in tried:
                said = decode_echoes(design, read, element.calibration, echoes, end_phases).level
                kind = 'undecodable' if said == UNDECODABLE else 'wrong'
                counts = found.setdefault(f'{what}, {names}', Counter())
                counts.update(['reads', 'right' if said == level else kind])
    return found


def merge_counts(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    """Return the counts of every preset, and of all together."""
    presets, none = kept.get('presets', {}) | {name: found}, {'wrong': 0}
    errors = {
        what: sum_counts([none, *(each[what] for each in presets.values())]) for what in found
    }
    return {'all': sum_counts(errors.values()), 'errors': errors, 'presets': presets}


STUDY = Study(
    'one_end', count_reads, STRAINED_PRESETS, ('lab/mlmem_lab/one_end.py',), SEED, merge_counts
)
