# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several elements as one word: n digits of base p, one in each element."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from ...contract.answers import Decoded
from ...contract.errors import RequestError
from ...words import BLANK
from .client import MemoryClient
from .line import Line
from .reply import Reply, Steps


@dataclass(frozen=True)
class Word:
    """What a bank holds.

    Attributes:
        digits: Level of every element, the least significant first; -1 where it is blank.
        base: How many levels an element has.
        answers: What every element said, in the same order.
    """

    digits: tuple[int, ...]
    base: int
    answers: tuple[Decoded, ...]

    @property
    def blank(self) -> bool:
        """Whether no element holds a level."""
        return all(digit == BLANK for digit in self.digits)

    @property
    def value(self) -> int | None:
        """The word as a number, or None where an element is blank."""
        if BLANK in self.digits:
            return None
        return sum(digit * self.base**place for place, digit in enumerate(self.digits))

    def __str__(self) -> str:
        """Return the digits as a person writes them: the most significant first."""
        return ' '.join('-' if digit == BLANK else str(digit) for digit in reversed(self.digits))


class BankFailed(RequestError):
    """Some elements did not do what they were asked for; the others did.

    Attributes:
        errors: What went wrong, by the full name of the element.
    """

    def __init__(self, errors: dict[str, RequestError], elements: int) -> None:
        reasons = '; '.join(f'{name}: {error}' for name, error in errors.items())
        super().__init__(f'{len(errors)} of {elements} elements failed: {reasons}')
        self.errors = errors


class MemoryBank:
    """Writes and reads one word in several elements at once.

    Every request goes to all elements at the same time, so that a bank takes as long as its
    slowest element. A word is not written in one stroke: when the power goes during a write,
    some elements hold the new digit and some the old one. The replies are awaited or waited for
    as those of a `MemoryClient`, and raise `BankFailed`.

    Attributes:
        elements: The clients, the least significant digit first.
        base: How many levels an element has.
    """

    def __init__(self, elements: Sequence[MemoryClient], base: int = 8) -> None:
        """Make a bank of elements.

        Args:
            elements: Clients on the same node, the least significant digit first.
            base: How many levels every element has (or how many of them to use), from 2.
        """
        if not elements:
            raise ValueError('elements must be at least one; got none')
        if base < 2:
            raise ValueError(f'base must be at least 2; got {base!r}')
        self.elements = tuple(elements)
        self.base = base
        names = f'{elements[0].name} ... {elements[-1].name}'
        self._line = Line(elements[0].node, ReentrantCallbackGroup(), names, 0.0)

    @classmethod
    def on(cls, node: Node, elements: int, namespace: str = '/bank', base: int = 8) -> MemoryBank:
        """Return the bank that `bank.launch.py` starts.

        Args:
            node: A node of the robot.
            elements: Their number: the launch argument `elements`.
            namespace: The launch argument `namespace`.
            base: How many levels an element has.
        """
        names = [f'{namespace.rstrip("/")}/element_{place}/mlmem' for place in range(elements)]
        return cls([MemoryClient(node, name) for name in names], base)

    @property
    def size(self) -> int:
        """How many words there are: 0 ... size - 1."""
        return self.base ** len(self.elements)

    @property
    def bits(self) -> int:
        """Whole bits that a word holds."""
        return self.size.bit_length() - 1

    def digits(self, word: int) -> tuple[int, ...]:
        """Return the digits of a word, the least significant first.

        Raises:
            ValueError: The word is no whole number from 0 to `size` - 1.
        """
        if isinstance(word, bool) or not isinstance(word, int) or not 0 <= word < self.size:
            raise ValueError(
                f'word must be a whole number from 0 to {self.size - 1}; got {word!r}'
            )
        return tuple(word // self.base**place % self.base for place in range(len(self.elements)))

    def ready(self, timeout: float = 10.0) -> Reply[None]:
        """Wait until all elements are there.

        Args:
            timeout: Longest wait in seconds.
        """
        replies = [element.ready(timeout) for element in self.elements]
        return self._gather('ready', replies, timeout, lambda _: None)

    def write(self, word: int, timeout: float = 60.0) -> Reply[Word]:
        """Write a word, every digit verified by an echo.

        Args:
            word: 0 ... `size` - 1.
            timeout: Longest wait for the answer in seconds.

        Raises:
            ValueError: The word is out of range.
        """
        digits = self.digits(word)
        replies = [
            element.write(digit, timeout)
            for element, digit in zip(self.elements, digits, strict=True)
        ]
        return self._gather(f'write {word}', replies, timeout, self._word)

    def read(self, timeout: float = 10.0, *, end: str = '') -> Reply[Word]:
        """Read the word.

        Args:
            timeout: Longest wait for the answer in seconds.
            end: The end to probe for this once, as in `MemoryClient.read`.
        """
        replies = [element.read(timeout, end=end) for element in self.elements]
        return self._gather('read', replies, timeout, self._word)

    def erase(self, timeout: float = 60.0) -> Reply[Word]:
        """Make all elements blank.

        Args:
            timeout: Longest wait for the answer in seconds.
        """
        replies = [element.erase(timeout) for element in self.elements]
        return self._gather('erase', replies, timeout, self._word)

    def _word(self, answers: Sequence[Decoded]) -> Word:
        """Return what the elements said as one word.

        Raises:
            BankFailed: One holds a level that is no digit.
        """
        errors = {
            element.name: RequestError(f'level {said.level} is no digit of base {self.base}')
            for element, said in zip(self.elements, answers, strict=True)
            if said.level >= self.base
        }
        if errors:
            raise BankFailed(errors, len(self.elements))
        return Word(tuple(said.level for said in answers), self.base, tuple(answers))

    def _gather(
        self,
        what: str,
        replies: Sequence[Reply[Any]],
        timeout: float,
        result: Callable[[Sequence[Any]], Word | None],
    ) -> Reply[Any]:
        """Return the reply that is there when all are, whatever becomes of them."""

        def steps() -> Steps[Word | None]:
            try:
                yield replies
            finally:  # given up: the parts are, too
                for reply in replies:
                    reply.cancel()
            answers, errors = [], {}
            for element, reply in zip(self.elements, replies, strict=True):
                try:
                    answers.append(reply.result())
                except RequestError as error:
                    errors[element.name] = error
            if errors:
                raise BankFailed(errors, len(self.elements))
            return result(answers)

        return Reply(self._line, what, steps(), timeout + 5.0)
