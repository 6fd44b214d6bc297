# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Words: numbers as sets of levels at which walls and kinks rest."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from ..errors import ErrorCode, SettingsError
from ..physics import Design

if TYPE_CHECKING:
    from ..settings import Settings


class Code(NamedTuple):
    """Numbers as sets of levels at least `spacing` apart (Cover 1973, IEEE Trans. Inf. Theory 19).

    With a spacing of 1 the levels are the bits of the number. Otherwise words are numbered in the
    order of their highest levels, as binary numbers are.
    """

    levels: int
    spacing: int

    @property
    def words(self) -> int:
        """Number of words; the first, 0, is that of the blank element."""
        return _count_words(self)

    def levels_below(self, level: int) -> range:
        """Return the levels of which the next wall below one may have any, the lowest first."""
        return range(max(0, level - self.spacing + 1))

    def walls(self, word: int) -> tuple[int, ...]:
        """Return the levels of a word, the lowest first; none of a blank element, -1 or 0."""
        return _list_words(self)[max(word, 0)][::-1]

    def word(self, walls: Sequence[int]) -> int:
        """Return the word of levels."""
        return bisect_left(_list_words(self), tuple(sorted(walls, reverse=True)))

    def is_valid_word(self, walls: Sequence[int]) -> bool:
        """Return whether levels, the lowest first, are those of a word."""
        inside = not walls or (walls[0] >= 0 and walls[-1] < self.levels)
        return inside and all(one in self.levels_below(other) for one, other in pairwise(walls))

    @property
    def single_wall_words(self) -> list[int]:
        """The words of one wall, at every level."""
        return [self.word([level]) for level in range(self.levels)]

    def format_binary(self, word: int) -> str:
        """Return a word in binary digits."""
        return f'{word:0{(self.words - 1).bit_length()}b}'


@lru_cache(maxsize=64)
def _count_words(code: Code) -> int:
    tops: list[int] = []  # words by their highest level
    for level in range(code.levels):
        tops.append(1 + sum(tops[other] for other in code.levels_below(level)))
    return 1 + sum(tops)


@lru_cache(maxsize=64)
def _list_words(code: Code) -> list[tuple[int, ...]]:
    """Return the levels of every word, the highest first: so words are in order."""
    words: list[tuple[int, ...]] = [()]
    for level in range(code.levels):
        below = code.levels_below(level)
        words += [(level, *lower) for lower in words if not lower or lower[0] in below]
    return words


def make_code(design: Design, settings: Settings) -> Code | None:
    """Return the code of an element with many walls, or None for one wall.

    Raises:
        SettingsError: The schedule has not one speed for each level, or there are too many words.
    """
    if not (spacing := settings.register.spacing):
        return None
    code = Code(design.levels, spacing)
    for name, speeds in (
        ('speeds', settings.kick.wall_speeds),
        ('kinks', settings.kick.kink_speeds),
    ):
        if len(speeds) < design.levels or not all(speeds[: design.levels]):
            raise SettingsError(
                ErrorCode.CONFLICT, f'kick.{name}', getattr(settings.kick, name),
                f'a kick of a wall and of a kink to each of the {design.levels} levels',
            )  # fmt: skip
    most = 2**14  # each forecast takes a twentieth of a millisecond, and 3 kB
    if code.words > most:
        expected = f'greater, for at most {most} words, all of which are forecast'
        raise SettingsError(ErrorCode.CONFLICT, 'register.spacing', spacing, expected)
    return code


def count_words(design: Design, settings: Settings) -> int:
    """Return how many contents an element tells apart; raises as `make_code`."""
    code = make_code(design, settings)
    return design.levels if code is None else code.words
