# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forecasts of reads, and what each candidate for a change would add to them."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlmem_ros.device.end import Shot
from mlmem_ros.element_file import Element
from mlmem_ros.physics import Integrator
from mlmem_ros.physics.potential import Array

from .changes import SHARED_KINDS
from .forward import Clock, Forward
from .unknowns import Unknowns

SPARSE = 1.0
"""Least time between two samples that are compared: the pass bands end well below its Nyquist."""

LONGER = 4
"""A forecast lasts longer than the first read by one part in so many: others listen longer."""

TINY = 1e-5
"""Strain for a difference quotient."""

KEPT = 32
"""Forecasts that are kept, each of a megabyte or two."""


@dataclass(frozen=True, eq=False)
class Forecast:
    """The waveforms of a read, shape (2, m), and their derivatives by candidates, (2, m, c)."""

    waveforms: Array
    J: Array
    stride: int


class Forecasts:
    """Makes the forecasts of an element, and keeps the latest."""

    def __init__(self, element: Element, integrator: Integrator | None) -> None:
        self.forward = forward_of(element, integrator)
        self._element = element
        self._integrator = integrator
        self._kept: OrderedDict[tuple[object, ...], Forecast] = OrderedDict()

    def of(self, shots: Sequence[Shot]) -> Forecast:
        """Return the forecast of a read, of the longest so far."""
        first = shots[0]
        begins = tuple(first.samples.shape[1] - shot.samples.shape[1] for shot in shots)
        pulses = tuple((shot.end, shot.omega_c, shot.A, shot.sigma) for shot in shots)
        key = pulses, begins, first.wall, first.strain
        every = max(1, math.floor(SPARSE / first.dt))
        known = self._kept.pop(key, None)
        if known is None or known.waveforms.shape[1] < 1 + first.samples.shape[1] // every:
            known = self._made(shots, every)
        self._kept[key] = known
        while len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        return known

    def _made(self, shots: Sequence[Shot], every: int) -> Forecast:
        unknowns = self.forward.unknowns
        room = np.empty((2, shots[0].samples.shape[1] // LONGER))
        shots = [replace(s, samples=np.concatenate((s.samples, room), axis=1)) for s in shots]
        first = shots[0]
        duration = first.samples.shape[1] * first.dt
        predicted, J = self.forward.linearised_exchange(shots, duration)
        clock = Clock.of(first.dt, self._integrator)
        sparse = max(1, every // clock.stride)
        columns = [J[:, ::sparse, unknowns.alpha] * self._element.specimen.alpha]
        for name in SHARED_KINDS:
            if name == 'strain':
                strained = [replace(shot, strain=shot.strain + TINY) for shot in shots]
                moved = self.forward.exchanged(strained, duration) - predicted
                columns.append(moved[:, ::sparse, None] / TINY)
                continue
            column = J[:, ::sparse, unknowns.shared(name)] * self.forward.x[unknowns.shared(name)]
            if name.startswith('gain_'):  # less motion is driven where more is read
                drive = unknowns.shared(name.replace('gain', 'drive'))
                column = column - J[:, ::sparse, drive] * self.forward.x[drive]
            columns.append(column[..., None])
        return Forecast(
            predicted[:, ::sparse],
            np.concatenate(columns, axis=2).astype(np.float32),
            sparse * clock.stride,
        )


def forward_of(element: Element, integrator: Integrator | None) -> Forward:
    """Return the forward model of an element in a file."""
    made = element.specimen
    unknowns = Unknowns(
        made.design, masses=bool((made.masses != 1.0).any()), offsets=bool(made.offsets.any()),
        springs=bool(made.springs),
    )  # fmt: skip
    x = unknowns.mean
    x[unknowns.alpha] = made.alpha
    for where, values in (
        (unknowns.mass, made.masses), (unknowns.offset, made.offsets), (unknowns.k_r, made.k_r),
    ):  # fmt: skip
        x[where] = values[: where.stop - where.start]
    x[unknowns.shared('time_unit')] = element.time_unit
    for name, ends in element.transducers.items():
        for end, value in zip(('left', 'right'), ends, strict=True):
            x[unknowns.shared(f'{name}_{end}')] = value
    return Forward(unknowns, x, integrator)
