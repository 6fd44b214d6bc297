# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The cases of the study: an element, what is random, what is tried, and how often at most."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from mlmem import load_element

from .element import (
    ALL_KINDS,
    JOINED_BY,
    KICK_TRIAL,
    READ_TRIAL,
    STEP_TRIAL,
    WORD_TRIAL,
    WORD_TRIALS,
)

TRIAL_LABELS = {
    STEP_TRIAL: 'step up', 'left': 'read from the left', 'right': 'read from the right',
    KICK_TRIAL: 'kick', WORD_TRIAL: 'word written', READ_TRIAL: 'word read',
}  # fmt: skip
"""What may be tried, in words."""

USUAL_TRIALS = (STEP_TRIAL, 'left', 'right')
"""What is tried by default."""


class Case(NamedTuple):
    """One curve.

    Attributes:
        element: A shipped name, or the path of an element file.
        kind: What is random, one of `ALL_KINDS`, or several at once, as `alpha+mass`.
        tried: One of `TRIAL_LABELS`.
        most: Trials of an amount after which counting stops, however few have failed.
    """

    element: str
    kind: str
    tried: str
    most: int

    def __str__(self) -> str:
        """Return the name of the case, such as `case_2 alpha step 200`."""
        return ' '.join(map(str, tuple(self)))


def split_case(name: str) -> Case:
    """Return the case of a name."""
    element, kind, tried, most = name.rsplit(' ', 3)
    return Case(element, kind, tried, int(most))


def list_cases(
    element: str, kinds: Sequence[str], trials: Sequence[str], most: int
) -> tuple[str, ...]:
    """Return the names of the cases of an element.

    Raises:
        ValueError: There is no such element, kind or trial, or the element has no such move.
    """
    design, settings = load_element(element).design_and_settings
    if unknown := sorted(set(JOINED_BY.join(kinds).split(JOINED_BY)) - set(ALL_KINDS)):
        raise ValueError(f'kinds must be of {", ".join(ALL_KINDS)}; got {", ".join(unknown)}')
    if unknown := sorted(set(trials) - set(TRIAL_LABELS)):
        raise ValueError(f'tried must be of {", ".join(TRIAL_LABELS)}; got {", ".join(unknown)}')
    kicked = settings.kick.wall_speeds
    if KICK_TRIAL in trials and not (len(kicked) == design.levels and all(kicked)):
        raise ValueError('tried can be kick only where every level has one (kick.speeds)')
    if set(WORD_TRIALS) & set(trials) and not settings.register.spacing:
        raise ValueError(
            f'tried can be {", ".join(WORD_TRIALS)} only in a register (register.spacing)'
        )
    if most < 1:
        raise ValueError(f'most must be at least 1; got {most}')
    return tuple(str(Case(element, kind, tried, most)) for kind in kinds for tried in trials)
