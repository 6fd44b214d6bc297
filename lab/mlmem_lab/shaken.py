# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads of an element on a shaking base or with noisy sensors: right, undecodable, wrong."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mlmem import (
    Disturb,
    Event,
    Faults,
    MemoryElement,
    Outcome,
    Read,
    SetFaults,
    Settings,
    load_element,
)
from mlmem.physics import Design, Specimen, find_level
from mlmem.physics.equilibrium import find_pinned_wall

from .study import Study, sum_counts

IMU_RATE_HZ = 200.0
"""IMU messages per second; a sine is updated every tick."""


@dataclass(frozen=True)
class Shaking:
    """The disturbance of an element during reads.

    Attributes:
        spectrum: 'white' (every message drawn anew, within the amplitude), 'walk' (two footfalls
            per second, with harmonics, and impacts of 20 to 90 Hz that ring for 30 ms), 'slams'
            (almost nothing, with sudden bursts of 5 ms), 'sine', or 'noise' (white, in both
            sensors).
        amplitude: In g; for noise, the standard deviation in cells.
        frequency: Of a sine, in Hz.
    """

    spectrum: str
    amplitude: float
    frequency: float = 0.0

    def __str__(self) -> str:
        """Return its name in a table."""
        if self.spectrum == 'noise':
            return f'sensor noise, {self.amplitude:g} cells'
        name = f'sine, {self.frequency:g} Hz' if self.spectrum == 'sine' else self.spectrum
        return f'{name}, {self.amplitude:g} g'

    def generate_course(self, seed: int, tick: float) -> Iterator[float]:
        """Yield the acceleration in m/s^2 at the end of every tick, which takes `tick` seconds."""
        random = np.random.Generator(np.random.PCG64(seed))
        each = {'white': _white_noise, 'walk': _random_walk, 'slams': _slam_pulses}.get(
            self.spectrum
        )
        course: Iterator[float] = (
            _hold_messages(each(random), tick) if each else itertools.repeat(0.0)
        )
        if self.spectrum == 'sine':
            omega, phase = 2.0 * math.pi * self.frequency, random.uniform(0.0, 2.0 * math.pi)
            course = (math.sin(omega * n * tick + phase) for n in itertools.count())
        standard_gravity = 9.81  # m/s^2
        return (self.amplitude * standard_gravity * share for share in course)


def _hold_messages(messages: Iterator[float], tick: float) -> Iterator[float]:
    """Yield the value of the last message, tick by tick."""
    sent = 0
    for n in itertools.count():
        while sent <= n * tick * IMU_RATE_HZ:
            last = next(messages)
            sent += 1
        yield last


def _white_noise(random: np.random.Generator) -> Iterator[float]:
    while True:
        yield float(random.uniform(-1.0, 1.0))


def _random_walk(random: np.random.Generator) -> Iterator[float]:
    harmonic_count = 8
    phases = random.uniform(0.0, 2.0 * math.pi, harmonic_count)
    order = np.arange(1, harmonic_count + 1)
    footfall, height, omega = 0.0, 0.0, 0.0
    steps_per_second = 2.0
    for n in itertools.count():
        t = n / IMU_RATE_HZ
        if t >= footfall + 1.0 / steps_per_second:
            footfall = t
            height = random.uniform(0.5, 1.0) * random.choice((-1.0, 1.0))
            omega = 2.0 * math.pi * random.uniform(20.0, 90.0)
        sway = np.sin(2.0 * math.pi * steps_per_second * order * t + phases) @ (0.3 / order)
        ring = height * math.exp((footfall - t) / 0.03) * math.sin(omega * (t - footfall))
        yield float(sway + ring)


def _slam_pulses(random: np.random.Generator) -> Iterator[float]:
    slam_every = 0.3
    while True:
        slam = random.uniform() < 1.0 / (slam_every * IMU_RATE_HZ)
        yield float(random.choice((-1.0, 1.0)) if slam else 1e-4 * random.standard_normal())


def count_block(
    design: Design,
    settings: Settings,
    shaking: Shaking,
    end: str,
    level: int,
    reads: int,
    seed: int,
) -> Counter[str]:
    """Read an element repeatedly, and count: one block.

    The end is 'left', 'right' or 'both', and the seed of all random numbers.

    Returns:
        reads: Those that were counted; `undecodable` of them gave no level, `wrong` another one.
        moved: Reads that were not counted because the wall had moved.
    """
    element = MemoryElement(design, settings)
    element.chain.place(find_pinned_wall(Specimen(design), level))
    element.transducer.assume_equilibrium()
    if shaking.spectrum == 'noise':
        element.apply(SetFaults(Faults(sensor_noise=shaking.amplitude, seed=seed)))
    scale = settings.scale
    course = shaking.generate_course(seed, settings.time.tick * scale.time)
    for _ in range(20):
        _advance_tick(element, next(course) / scale.acceleration)
    counts = Counter(reads=reads)
    for _ in range(reads):
        element.apply(Read(end))
        while element.procedure:
            events = _advance_tick(element, next(course) / scale.acceleration)
        [outcome] = [event for event in events if isinstance(event, Outcome)]
        if not outcome.success or outcome.reading is None:
            counts['undecodable'] += 1
        else:
            counts['wrong'] += outcome.reading.level != level
    if find_level(design, element.chain.configuration, 0.5 * design.J) != level:
        return Counter(moved=reads)
    return counts


def _advance_tick(element: MemoryElement, acceleration: float) -> list[Event]:
    if acceleration != element.base.state.target:
        element.apply(Disturb(acceleration))
    return element.advance()


def list_disturbances() -> dict[str, tuple[str, Shaking]]:
    """Return the end that reads, and its disturbance, by the name of the case."""
    return {f'{end}, {shaking}': (end, shaking) for end, shaking in (
        *(('left', Shaking('white', g)) for g in (1.0, 1.5, 18.0, 22.0)),
        *(('left', Shaking('sine', g, hz)) for g, hz in (
            (30.0, 16.0), (22.0, 95.0), (11.0, 110.0), (2.5, 125.0), (12.0, 125.0), (12.0, 229.0),
        )),
        *(('left', Shaking('walk', g)) for g in (3.0, 50.0)),
        ('left', Shaking('slams', 40.0)),
        *(('left', Shaking('noise', cells)) for cells in (1.5e-5, 2.1e-5)),
        *(('right', Shaking('white', g)) for g in (1.5, 14.0)),
        *(('right', Shaking('sine', g, hz)) for g, hz in (
            (40.0, 16.0), (28.0, 125.0), (14.0, 190.0), (3.0, 229.0), (4.2, 247.0), (4.0, 250.0),
        )),
        *(('right', Shaking('walk', g)) for g in (3.0, 50.0)),
        ('right', Shaking('slams', 40.0)),
        *(('right', Shaking('noise', cells)) for cells in (1.5e-4, 2e-4)),
        ('both', Shaking('white', 10.0)),
        ('both', Shaking('walk', 20.0)),
    )}  # fmt: skip


def count_reads(case: str, seed: int, count: int = 200) -> dict[str, Any]:
    """Return how reads of `case_2` at random levels ended."""
    design, settings = load_element('case_2').design_and_settings
    end, shaking = list_disturbances()[case]
    random = np.random.default_rng(seed + 1000 * shaken_study.cases.index(case))
    counts = Counter[str]()
    while counts['reads'] + counts['moved'] < count:
        level, own_seed = int(random.integers(design.levels)), int(random.integers(2**31))
        counts.update(count_block(design, settings, shaking, end, level, 20, own_seed))
    return {name: counts[name] for name in ('reads', 'moved', 'undecodable', 'wrong')}


shaken_study = Study(
    'shaken',
    count_reads,
    tuple(list_disturbances()),
    ('lab/mlmem_lab/shaken.py',),
    1,
    lambda presets: {'all': sum_counts(presets.values())},
)
