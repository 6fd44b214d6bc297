# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The answer of a bank of elements: one word, and the corrections made to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mlmem_ros.contract.answers import Decoded
from mlmem_ros.contract.calls import BankFailed, RequestError
from mlmem_ros.procedures import BLANK

from .word_code import WordCode, WordError


@dataclass(frozen=True)
class Corrected:
    """A digit that the code corrected.

    Attributes:
        read: The level it reported; -1 if blank, None if it could not be read.
        digit: What it should hold.
        why: Why it could not be read; empty if it could.
    """

    element: str
    read: int | None
    digit: int
    why: str = ''


@dataclass(frozen=True)
class Word:
    """The content of a bank.

    Attributes:
        digits: Level of every element, the least significant first, check digits last; -1 if
            blank.
        base: Levels used per element.
        answers: Every element's answer, in the same order; None if it could not be read.
        check: Number of check digits.
        corrected: The digits that differ from what their elements hold.
    """

    digits: tuple[int, ...]
    base: int
    answers: tuple[Decoded | None, ...]
    check: int = 0
    corrected: tuple[Corrected, ...] = ()

    @property
    def blank(self) -> bool:
        """Whether no element holds a level."""
        return all(digit == BLANK for digit in self.digits)

    @property
    def value(self) -> int | None:
        """The word as a number, or None if an element is blank."""
        if BLANK in self.digits:
            return None
        value = 0
        for digit in reversed(self._data):
            value = value * self.base + digit
        return value

    def __str__(self) -> str:
        """Return the digits as a person writes them: most significant first, no check digits."""
        return ' '.join('-' if digit == BLANK else str(digit) for digit in reversed(self._data))

    @property
    def _data(self) -> tuple[int, ...]:
        return self.digits[: len(self.digits) - self.check]


def word_of(
    code: WordCode,
    names: Sequence[str],
    answers: Mapping[int, Decoded],
    errors: Mapping[int, RequestError],
) -> Word:
    """Return the answers of elements, and why none came, both by index, as one word.

    Raises:
        BankFailed: An element could not be read or holds no digit, and there is no code.
        WordError: The digits are not a word.
    """
    errors = {**errors}
    for place, said in answers.items():
        if said.level >= code.base:
            errors[place] = RequestError(f'level {said.level} is not a digit of base {code.base}')
    failed = BankFailed({names[place]: error for place, error in errors.items()}, len(names))
    if errors and not code.check:
        raise failed
    read = [answers[place].level if place in answers else None for place in range(len(names))]
    try:
        digits = code.decode(read)
    except WordError as error:
        raise error from failed if errors else None
    corrected = tuple(
        Corrected(names[place], level, digit, f'{errors.get(place, "")}')
        for place, (level, digit) in enumerate(zip(read, digits, strict=True))
        if level != digit
    )
    heard = tuple(answers.get(place) for place in range(len(names)))
    return Word(digits, code.base, heard, code.check, corrected)
