# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a fit is worth to a register: python3 -m mlmem_lab.fitted_words makes
results/fitted_words.json.

The same random words are written to elements whose alpha scatters as designed, read by a twin, and
kicked as planned for it, too. The twin of `byte` knows every alpha to `TWIN_ALPHA_ERROR`. That of
`byte, fitted` is the fit of a survey with noisy transducers, of one element each. Nothing is
discarded.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mlmem import Faults, MemoryElement, SetFaults, Shot, Survey, new_element, preset
from mlmem.element_file import Element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Specimen
from mlmem.settings import Settings

from .fit.command import build_element
from .fit.fit import Misfitting, fit_element
from .plans.plan import Plan, plan_pulses
from .results import run
from .twins.sensed import make_specimen, perform_command
from .twins.surveyed import TRANSDUCER_NOISE_CELLS
from .words import count_writes

SEED, SCATTERS, SPECIMENS, WORDS = 1, (0.002, 0.005, 0.01), 5, 24
"""Scatters of alpha; elements of each; words written on each element, in every way."""

TWIN_ALPHA_ERROR = 0.0015
"""Error of every alpha of a twin, relative (s.d.): more than the fits here have."""

SURVEY_PRESETS = ('byte', 'case_2')
"""Presets of the same element that survey it: the second launches by strain, if no kick does."""

BYTE, FITTED = 'byte', 'byte, fitted'


def make_known_twin(truth: Specimen, seed: int) -> Element:
    """Return a twin that is a little off."""
    error = TWIN_ALPHA_ERROR * np.random.default_rng([SEED, seed]).standard_normal(truth.design.N)
    twin = replace(truth, alpha_factor=truth.alpha_factor * (1.0 + error))
    return Element(twin, TWIN_ALPHA_ERROR * twin.alpha)


def fit_twin(truth: Specimen, seed: int) -> Element:
    """Return what a survey and a fit know of an element.

    Raises:
        Misfitting: No instrument surveys it, or the model does not describe it.
    """
    for instrument in SURVEY_PRESETS:
        device = _build_device(truth, preset(instrument).settings)
        device.apply(SetFaults(Faults(sensor_noise=TRANSDUCER_NOISE_CELLS, seed=seed)))
        outcome, events = perform_command(device, Survey())
        if outcome.success:
            shots = [event for event in events if isinstance(event, Shot)]
            return build_element(fit_element(truth.design, shots))
    raise Misfitting(outcome.error)


def _build_device(specimen: Specimen, settings: Settings) -> MemoryElement:
    driver = Simulation.of(specimen, settings.time)
    return new_element(specimen.design, settings, driver=driver)


def count_kicked_writes(entry: str) -> dict[str, Any]:
    """Return the counts by scatter and way, how far twins are off, and how many kicks of walls and
    kinks to levels were not found.
    """
    return {f'{scatter:g}': _count_scatter(entry, scatter) for scatter in SCATTERS}


def _count_scatter(entry: str, scatter: float) -> dict[str, Any]:
    chosen, twins, found = preset(BYTE), list[Element](), list[Plan]()
    truths = [
        make_specimen(BYTE, scatter, seed) for seed in range(1 if entry == FITTED else SPECIMENS)
    ]
    for seed, truth in enumerate(truths):
        twin = fit_twin(truth, seed) if entry == FITTED else make_known_twin(truth, seed)
        found.append(plan_pulses(twin.timed_specimen, chosen))
        twins.append(replace(twin, plan=found[-1].corrections))
    ways: dict[str, Sequence[Element | None]] = {
        'as designed': [None] * len(twins),
        'read by the twin': [replace(each, plan=None) for each in twins],
        'and kicked as planned': twins,
    }

    def build_devices(twins: Sequence[Element | None]) -> Iterator[MemoryElement]:
        for truth, twin in zip(truths, twins, strict=True):
            device = _build_device(
                truth, twin.apply_planned_kicks(chosen.settings) if twin else chosen.settings
            )
            if twin is not None:
                device.adopt(twin.timed_specimen)
            yield device

    kicks = [step for each in found for step in (*each.steps, *each.kinks)]
    return {
        'alpha off by': max(map(_strength_error, twins, truths)),
        'kicks': len(kicks),
        'not found': sum(step.margin < 0.0 for step in kicks),
        'ways': {
            way: count_writes(build_devices(twins), np.random.default_rng(SEED), WORDS)
            for way, twins in ways.items()
        },
    }


def _strength_error(twin: Element, truth: Specimen) -> float:
    """Return the error of the strength of a twin's cells, relative (rms)."""
    its = twin.specimen
    strength = its.alpha * its.design.d / (truth.alpha * truth.design.d)
    return float(np.sqrt(np.mean((strength - 1.0) ** 2)))


if __name__ == '__main__':
    MODULES = [
        'lab/mlmem_lab/fit', 'lab/mlmem_lab/plans', 'lab/mlmem_lab/twins',
        'lab/mlmem_lab/words.py',
    ]  # fmt: skip
    sys.exit(
        run(
            'fitted_words',
            __doc__,
            count_kicked_writes,
            SEED,
            entries=(BYTE, FITTED),
            modules=MODULES,
        )
    )
