# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether an element with many walls holds every word, and can tell it from all others; and what
is left of one with known bad cells.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mlmem.errors import SettingsError
from mlmem.factory import rehearse_levels as forecasts_with
from mlmem.physics import Design
from mlmem.readers.register import forecast_words
from mlmem.settings import Settings

from .concern import Finding, Subject, Verdict, grade_finding, judge_value

LEAST, COMFORT = 0.01, 0.03
"""Least difference between two forecasts, over the pulse, and that from which noise of a
thousandth of the pulse leaves room."""


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the finding on the words of an element with many walls; none for one wall."""
    settings = subject.settings
    if not settings.holds_words:
        return
    try:
        found = forecast_words(subject.made, settings)
    except SettingsError as error:
        yield Finding('words', {}, '', Verdict.FAIL, str(error))
        return
    pulse = float(np.linalg.norm(found.parts[0]))  # of the blank element: mostly the pulse itself
    least = float(found.nearest_distances.min()) / pulse
    yield grade_finding(
        'words',
        {'words': float(found.code.words), 'least difference': least},
        '',
        judge_value(least, LEAST, COMFORT),
        'walls rest in every word, and no two words answer the pulse of a read alike',
        'two words, or one and walls between levels, answer it nearly alike: choose another '
        'register.omega_c, a shorter register.sigma, or a greater register.spacing',
    )


def judge_bad_cells(design: Design, settings: Settings) -> Finding:
    """Return the finding on the levels that known bad cells leave; a warning if any is lost."""
    try:
        found = forecasts_with(design, settings)
    except SettingsError as error:
        return Finding('bad_cells', {}, '', Verdict.FAIL, str(error))
    values = {'usable levels': float(len(found.usable)), 'levels': float(design.levels)}
    verdict = Verdict.WARN if found.lost else Verdict.PASS
    return Finding('bad_cells', values, '', verdict, found.limits)
