# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether an element with many walls holds every word, and can tell it from all others; and what
is left of one with known bad cells.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mlmem_ros.device.errors import SettingsError
from mlmem_ros.device.factory import rehearsed as forecasts_with
from mlmem_ros.device.peeling import Peeled
from mlmem_ros.device.register import forecasts_of, resting
from mlmem_ros.device.settings import Settings
from mlmem_ros.device.waveforms import BAND
from mlmem_ros.host.design_check import Verdict
from mlmem_ros.physics import Design, StateError
from mlmem_ros.physics.waves import group_velocity

from .concern import Finding, Subject, graded, judged

LEAST, COMFORT = 0.01, 0.03
"""Least difference between two forecasts, over the pulse, and that from which noise of a
thousandth of the pulse leaves room."""

SOURCE = (
    'the capacity of one wall is m = floor(log2 p) bits (p. 3); many walls are not in the paper'
)


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the finding on the words of an element with many walls; none for one wall."""
    settings = subject.settings
    if not settings.register.spacing:
        return
    if settings.register.shifted:
        yield from _shifted(subject)
        return
    try:
        found = forecasts_of(subject.made, settings)
    except SettingsError as error:
        yield Finding('words', {}, '', Verdict.FAIL, str(error), SOURCE)
        return
    pulse = float(np.linalg.norm(found.parts[0]))  # of the blank element: mostly the pulse itself
    least = float(found.nearest.min()) / pulse
    yield graded(
        'words',
        {'words': float(found.code.words), 'least difference': least},
        '',
        judged(least, LEAST, COMFORT),
        'walls rest in every word, and no two words answer the pulse of a read alike',
        'two words, or one and walls between levels, answer it nearly alike: choose another '
        'register.omega_c, a shorter register.sigma, or a greater register.spacing',
        SOURCE,
    )


def _shifted(subject: Subject) -> Iterator[Finding]:
    """Yield the finding on the words of a register that is shifted: as many walls as there may be
    rest.
    """
    source = 'least distances are run-length limits; many walls are not in the paper'
    try:
        found = Peeled(subject.made, subject.settings)
        resting(subject.made, found.code.walls(found.code.words - 1))
    except (SettingsError, StateError) as error:
        yield Finding('words', {}, '', Verdict.FAIL, str(error), source)
        return
    settings, design = subject.settings.register, subject.design
    fast, phases = settings.omega_c + BAND / settings.sigma, (design.k_s1, design.k_s2)
    values = {
        'words': float(found.code.words),
        'levels': float(found.code.levels),
        'last echo': design.N / min(float(group_velocity(fast, k)) for k in phases),
    }
    yield graded(
        'words',
        values,
        '',
        Verdict.PASS if values['last echo'] < settings.listen else Verdict.WARN,
        'as many walls rest as a word may have, and an echo of the middle returns in time',
        'the slowest part of the pulse comes back from the middle after the end of listening, so '
        'words with many walls are undecodable: lower register.omega_c, or increase '
        'register.sigma or register.listen',
        source,
    )


def bad_cells(design: Design, settings: Settings) -> Finding:
    """Return the finding on the levels that known bad cells leave; a warning if any is lost."""
    source = (
        'a wall is pinned at any one of the soft defects (p. 2); bad cells are not in the paper'
    )
    try:
        found = forecasts_with(design, settings)
    except SettingsError as error:
        return Finding('bad_cells', {}, '', Verdict.FAIL, str(error), source)
    values = {'usable levels': float(len(found.usable)), 'levels': float(design.levels)}
    verdict = Verdict.WARN if found.lost else Verdict.PASS
    return Finding('bad_cells', values, '', verdict, str(found), source)
