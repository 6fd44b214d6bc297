# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several elements as one word: n digits of base p, one in each element, and corrections."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node

from mlmem_ros.contract.answers import Decoded
from mlmem_ros.contract.calls import BankFailed, RequestError, RequestFailed, RequestRefused
from mlmem_ros.procedures import BLANK
from mlmem_ros.ros.client.client import MemoryClient
from mlmem_ros.ros.client.link import Connection
from mlmem_ros.ros.client.reply import Reply, Steps

from .word_code import Phase, WordCode, WordError


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
    errors, seal = {**errors}, len(names) - 1
    torn = code.check and seal in answers and answers[seal].level == code.base
    for place, said in answers.items():
        if said.level >= code.base and not (torn and place == seal):
            errors[place] = RequestError(f'level {said.level} is not a digit of base {code.base}')
    failed = BankFailed({names[place]: error for place, error in errors.items()}, len(names))
    if errors and not code.check:
        raise failed
    read = [answers[place].level if place in answers else None for place in range(len(names))]
    if torn:
        read[seal] = BLANK
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


SHORTEST = 0.1
"""Seconds that an element gets to answer at least, however late the others were."""


class MemoryBank:
    """Writes and reads one word in several elements at once.

    Requests go to all elements at the same time, so a bank takes as long as its slowest element.
    The replies are used like those of a `MemoryClient`, and raise `BankFailed`.

    Without check digits, a power failure during a write goes unnoticed: some elements hold the new
    digit, others the old one. With check digits (`check`), the last elements hold those of a code.
    It corrects wrong or unreadable digits as far as it can, and reports them in `Word.corrected`;
    a read raises `TornWord` if a write was interrupted, and `LostWord` if the code cannot correct
    the word. `bank.word_code` describes the code and its probability of error. A write then
    takes three phases: erase the last element, write the others, write the last one. Only one
    client at a time may write. An erased element with many walls reads 0, which is a digit: there
    the last one holds `base` meanwhile, and must have more contents than that.

    Attributes:
        elements: The clients, the least significant digit first, check digits last.
        code: Encodes words as digits, with `base` and `check`.
    """

    def __init__(self, elements: Sequence[MemoryClient], base: int = 8, check: int = 0) -> None:
        """Make a bank of elements.

        Args:
            elements: Clients on the same node, the least significant digit first.
            base: Levels of every element, or how many of them to use; at least 2.
            check: How many of the elements, the last ones, hold check digits. Two correct one
                wrong or two unreadable elements. The base must then be a power of two, greater
                than the number of elements.

        Raises:
            ValueError: There is no such word.
            ModuleNotFoundError: The library of the code is missing (the extra `code`).
        """
        if not elements:
            raise ValueError('elements must be at least one; got none')
        self.code = WordCode(len(elements), base, check)
        self.elements = tuple(elements)
        self._names = tuple(element.name for element in elements)
        names = f'{self._names[0]} ... {self._names[-1]}'
        self._connection = Connection(elements[0].node, names, 0.0)
        self._change: Reply[Word] | None = None

    @classmethod
    def on(
        cls, node: Node, elements: int, namespace: str = '/bank', base: int = 8, check: int = 0
    ) -> MemoryBank:
        """Return the bank that `bank.launch.py` or `memory_bank` starts with these arguments;
        `base` and `check` as in `MemoryBank`.
        """
        names = [f'{namespace.rstrip("/")}/element_{place}/mlmem' for place in range(elements)]
        return cls([MemoryClient(node, name, actions=False) for name in names], base, check)

    @property
    def base(self) -> int:
        """How many levels an element has."""
        return self.code.base

    @property
    def size(self) -> int:
        """Number of words, which go from 0 to size - 1."""
        return self.code.size

    @property
    def bits(self) -> int:
        """Whole bits that a word holds."""
        return self.size.bit_length() - 1

    def digits(self, word: int) -> tuple[int, ...]:
        """Return the digits of a word, the least significant first, check digits last.

        Raises:
            ValueError: The word is not a whole number from 0 to `size` - 1.
        """
        return self.code.digits(word)

    def ready(self, timeout: float = 10.0) -> Reply[None]:
        """Wait until all elements are available, at most `timeout` seconds."""

        def steps() -> Steps[None]:
            replies = {place: each.ready(timeout) for place, each in enumerate(self.elements)}
            _, errors = yield from _together(replies)
            if errors:
                raise self._failed(errors)

        return Reply(self._connection, 'ready', steps(), timeout + 5.0)

    def write(self, word: int, timeout: float = 60.0, *, spare: int = 0) -> Reply[Word]:
        """Write a word, every digit verified by an echo.

        Args:
            word: 0 ... `size` - 1.
            timeout: Longest wait for the answer in seconds.
            spare: How many elements may fail, at most half as many as check digits; the last
                must not. They are reported in `Word.corrected`.

        Raises:
            ValueError: The word or `spare` is out of range.
        """
        if not 0 <= spare <= self.code.check // 2:
            raise ValueError(f'spare must be from 0 to {self.code.check // 2}; got {spare!r}')
        return self._changing(f'write {word}', self.digits(word), timeout, spare)

    def read(self, timeout: float = 10.0, *, end: str = '') -> Reply[Word]:
        """Read the word; `end` is the one to probe this time, as in `MemoryClient.read`."""

        def steps() -> Steps[Word]:
            replies = {p: each.read(timeout, end=end) for p, each in enumerate(self.elements)}
            answers, errors = yield from _together(replies)
            return word_of(self.code, self._names, answers, errors)

        return Reply(self._connection, 'read', steps(), timeout + 5.0)

    def erase(self, timeout: float = 60.0) -> Reply[Word]:
        """Make all elements blank, waiting at most `timeout` seconds for the answer."""
        return self._changing('erase', (BLANK,) * len(self.elements), timeout)

    def _changing(
        self, what: str, digits: Sequence[int], timeout: float, spare: int = 0
    ) -> Reply[Word]:
        """Write digits, phase by phase: each begins when the previous one is confirmed."""
        until, seal = time.monotonic() + timeout, len(self.elements) - 1

        def phase(levels: Phase) -> Mapping[int, Reply[Any]]:
            remaining = max(SHORTEST, until - time.monotonic())
            return {
                place: self.elements[place].erase(remaining)
                if level == BLANK
                else self.elements[place].write(level, remaining)
                for place, level in levels.items()
                if place not in failed
            }

        def check() -> None:
            if len(failed) > spare or seal in failed:
                raise self._failed(failed)

        def steps() -> Steps[Word]:
            if under_way:
                raise RequestRefused({'error': 'busy: the bank is being written'})
            said: dict[int, Decoded] = {}
            if self.code.check:  # notice an absent element before breaking the seal
                looks = {place: each.read(timeout) for place, each in enumerate(self.elements)}
                _, errors = yield from _together(looks)
                failed.update({p: e for p, e in errors.items() if type(e) is not RequestFailed})
                check()
            phases = list(self.code.phases(digits))
            while phases:
                levels = phases.pop(0)
                answers, errors = yield from _together(phase(levels))
                if seal in errors and levels[seal] == self.base:
                    why = 'which marks a write that is under way: use a smaller base'
                    errors = {seal: RequestRefused({'error': f'{errors[seal]}, {why}'})}
                said |= answers
                failed.update(errors)
                check()
                begun = self.code.check and levels == {seal: BLANK} and phases
                if begun and said[seal].level != BLANK:  # it holds many walls
                    phases = [{seal: self.base}, *phases]
                    phases += [{seal: BLANK}] if digits[seal] == BLANK else []
            return word_of(self.code, self._names, said, failed)

        failed: dict[int, RequestError] = {}
        before = self._change
        under_way = self.code.check and before and not before.done()
        reply = Reply(self._connection, what, steps(), timeout + 5.0)
        if not under_way:
            self._change = reply
        return reply

    def _failed(self, errors: Mapping[int, RequestError]) -> BankFailed:
        return BankFailed(
            {self._names[place]: errors[place] for place in errors}, len(self._names)
        )


def _together(
    replies: Mapping[int, Reply[Any]],
) -> Steps[tuple[dict[int, Any], dict[int, RequestError]]]:
    """Return answers and errors of the elements, by index, when all have ended."""
    try:
        yield list(replies.values())
    finally:  # cancel the parts, too
        for reply in replies.values():
            reply.cancel()
    answers: dict[int, Any] = {}
    errors: dict[int, RequestError] = {}
    for place, reply in replies.items():
        try:
            answers[place] = reply.result(0)
        except RequestError as error:
            errors[place] = error
    return answers, errors
