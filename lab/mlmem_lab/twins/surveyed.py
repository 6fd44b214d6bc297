# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fits of hidden elements: whether their intervals hold the truth, and how far off they are.

A hidden element is integrated by Runge and Kutta's method at a fine step, everything its cells
share is off, its transducers are noisy and have gains of their own, and it is at the other end of
a line. All that a fit gets is the shots of a survey.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mlmem import MemoryElement, Shot, Survey, factory_calibration, load_element
from mlmem.element_file import Element
from mlmem.physics import Design, Scatter, draw_specimen
from mlmem_tools.identification.fit import Misfitting, fit_element
from mlmem_tools.rig.emulated import RigSensors

from ..rk4 import Rk4Element
from .sensed import TRANSDUCER_NOISE_CELLS, HiddenElement, perform_command

HIDDEN_KINDS: dict[str, dict[str, float]] = {
    'alpha': {},
    'springs 0.1 %': {'k_r': 0.001},
    'springs 0.3 %': {'k_r': 0.003},
    'masses 0.3 %': {'mass': 0.003},
    'latency up to a sample': {'latency': 1.0},
    'gains drift by 0.1 %': {'drift': 0.001},
    'gains drift by 0.5 %': {'drift': 0.005},
    'damping 20 %': {'damping': 0.2},
    'friction 3e-6': {'friction': 3e-6},
    'third harmonic 0.3 %': {'harmonic': 0.003},
}
"""What a hidden element has besides alpha that scatters, with its amount (s.d. of scatter)."""


def make_hidden_element(design: Design, scatter: float, seed: int, kind: str) -> Element:
    """Return an element whose cells scatter and whose shared values are off, and its clock."""
    random = np.random.default_rng([seed, design.N])

    max_shared_error = 0.02  # most by which what all cells share is off, relative

    def draw_about(value: float) -> float:
        return float(value * (1.0 + max_shared_error * random.uniform(-1.0, 1.0)))

    made = replace(
        design, d=draw_about(design.d), a=draw_about(design.a), eta=draw_about(design.eta),
        s_max=draw_about(design.s_max), j_0=design.j_0 + 0.2 * random.uniform(-1.0, 1.0),
    )  # fmt: skip
    amount = HIDDEN_KINDS[kind]
    scatters = Scatter(alpha=scatter, k_r=amount.get('k_r', 0.0), mass=amount.get('mass', 0.0))
    specimen = draw_specimen(made, scatters, seed)
    return Element(specimen, np.zeros(design.N), time_unit=draw_about(1.0))


def survey_element(preset: str, scatter: float, seed: int, kind: str) -> dict[str, Any]:
    """Return how well a hidden element is found from a survey.

    Returns:
        How many shots there were; the fit's misfit, and what it added to the model; the share of
        cells inside their 95 % intervals; the error of alpha and what the fit states (rms,
        relative). Or only why there is no fit.
    """
    chosen = load_element(preset)
    truth = make_hidden_element(chosen.design, scatter, seed, kind)
    found: dict[str, Any] = {'seed': seed}
    try:
        shots = survey_shots(preset, truth, seed, kind)
        found['shots'] = len(shots)
        fitted = fit_element(chosen.design, shots)
    except Misfitting as error:
        return found | {'refused': str(error)}
    made = truth.specimen
    strength = made.alpha * made.design.d / chosen.design.d
    alpha, deviation = (each[fitted.unknowns.alpha] for each in (fitted.x, fitted.deviations))
    interval_deviations = 1.959964  # standard deviations to either side of a 95 % interval
    return found | {
        'chi2': fitted.chi2,
        'in band': fitted.in_band,
        'added': fitted.added_terms,
        'inside': float(np.mean(np.abs(alpha - strength) < interval_deviations * deviation)),
        'error': float(np.sqrt(np.mean((alpha / strength - 1.0) ** 2))),
        'stated': float(np.sqrt(np.mean((deviation / strength) ** 2))),
    }


def survey_shots(preset: str, truth: Element, seed: int, kind: str) -> list[Shot]:
    """Return the shots of a survey of a hidden element.

    Raises:
        Misfitting: The survey failed.
    """
    design, settings = load_element(preset).design_and_settings
    random, amount = np.random.default_rng([seed, 1]), HIDDEN_KINDS[kind]
    gain_deviation = 0.01  # standard deviation of a transducer's gain
    gains = 1.0 + gain_deviation * random.standard_normal(2)
    late = random.integers(1, HiddenElement.PARTS + 1, 2) if 'latency' in amount else (0, 0)
    uneven = 1.0 + amount.get('damping', 0.0) * random.standard_normal(design.N)
    sample_period = 0.25  # time units between two samples of a transducer
    element = Rk4Element(
        truth.timed_specimen,
        sample_period / HiddenElement.PARTS,
        damping=np.maximum(uneven, 0.1),
        friction=amount.get('friction', 0.0),
        harmonic=amount.get('harmonic', 0.0),
    )
    sensors = RigSensors(
        gain=(float(gains[0]), float(gains[1])), noise=TRANSDUCER_NOISE_CELLS, seed=seed
    )
    late_samples = int(late[0]), int(late[1])
    driver = HiddenElement(element, sensors, late_samples, amount.get('drift', 0.0))
    device = MemoryElement(design, settings, factory_calibration(design, settings), driver)
    outcome, events = perform_command(device, Survey())
    if not outcome.success:
        raise Misfitting(f'the survey failed: {outcome.error}')
    return [event for event in events if isinstance(event, Shot)]


def summarise_fits(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what many fits have in common."""
    fits = [row for row in rows if 'chi2' in row]
    told = {
        'elements': len(rows), 'fitted': len(fits),
        'refused': [row['refused'] for row in rows if 'refused' in row],
    }  # fmt: skip
    if not fits:
        return told
    error, stated = (np.array([row[name] for row in fits]) for name in ('error', 'stated'))
    min_lie_ratio = 3.0  # error over what a fit states from which it lies
    return told | {
        'lies': int(np.sum(error > min_lie_ratio * stated)),
        'most off': np.max(error / stated),
        'added': dict(Counter(', '.join(row['added']) or 'nothing' for row in fits)),
    }
