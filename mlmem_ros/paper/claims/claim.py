# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A sentence of the paper that can be checked, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from ..figure import Data


class Verdict(Enum):
    """What our simulation says of a sentence."""

    HOLDS = 'holds'
    IN_PART = 'in part'
    FAILS = 'fails'


@dataclass(frozen=True)
class Finding:
    """A verdict and the numbers behind it.

    Attributes:
        verdict: What our simulation says.
        numbers: Our numbers in one or two sentences of Markdown.
    """

    verdict: Verdict
    numbers: str


Judge = Callable[..., Finding]


@dataclass(frozen=True)
class Claim:
    """A checkable sentence of the paper.

    Attributes:
        key: Short name, unique.
        sentence: The sentence, shortened.
        place: Where the paper has it.
        how: How our number was obtained.
        needs: Studies whose data the judge takes, in this order.
        judge: Returns the finding from those data.
    """

    key: str
    sentence: str
    place: str
    how: str
    needs: tuple[str, ...]
    judge: Judge

    def find(self, data: Mapping[str, Data]) -> Finding:
        """Judge the claim by the data of all studies, by name."""
        return self.judge(*(data[name] for name in self.needs))


def collector() -> tuple[list[Claim], Callable[..., Callable[[Judge], Judge]]]:
    """Return a list, and a decorator that appends a judge to it as a claim.

    The judge's docstring is the sentence, its name the key.
    """
    claims: list[Claim] = []

    def claim(*, place: str, how: str, needs: tuple[str, ...]) -> Callable[[Judge], Judge]:
        def keep(judge: Judge) -> Judge:
            sentence = ' '.join((judge.__doc__ or '').split()).rstrip('.')
            claims.append(Claim(judge.__name__, sentence, place, how, needs, judge))
            return judge

        return keep

    return claims, claim


def verdict(holds: bool, *, in_part: bool = False) -> Verdict:
    """Return HOLDS, or else IN_PART where something of it is true, or else FAILS."""
    if holds:
        return Verdict.HOLDS
    return Verdict.IN_PART if in_part else Verdict.FAILS
