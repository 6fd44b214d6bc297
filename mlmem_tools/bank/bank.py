# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One value in several elements: each holds one digit, the last one holds a check digit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, TypeVar

from rclpy.node import Node

from mlmem.procedure_table import BLANK
from mlmem_ros.contract.answers import BankFailed, RequestError
from mlmem_ros.ros.client.client import MemoryClient
from mlmem_ros.ros.client.reply import Reply

T = TypeVar('T')


@dataclass(frozen=True)
class BankValue:
    """The content of a bank.

    Attributes:
        value: The stored number; None if all elements are blank.
        digits: The content of every element, the least significant digit first, the check digit
            last.
        recovered: The full name of the element that could not be read and whose digit was
            computed from the others; empty if all were read. A recovered value is not checked.
    """

    value: int | None
    digits: tuple[int, ...]
    recovered: str = ''


class BankCheckFailed(RequestError):
    """The digits of a bank do not sum to zero: a write was torn, or an element is wrong.

    Attributes:
        digits: The content of every element as read, the check digit last.
    """

    def __init__(self, digits: Sequence[int]) -> None:
        text = ' '.join(map(str, digits))
        super().__init__(
            f'the digits {text} do not match the check digit: a write was torn, or an element is '
            'wrong; write the value again'
        )
        self.digits = tuple(digits)


class MemoryBank:
    """Writes and reads one number in several elements at once.

    Requests go to all elements at the same time, so a bank takes as long as its slowest element.
    The replies are used like those of a `MemoryClient`, and raise `BankFailed`, which names the
    elements that failed.

    The digits of all elements, the check digit included, sum to 0 modulo `base`. So a read
    detects one wrong element for certain, and recovers one element that cannot be read. A torn
    write (some elements hold the new digit, others the old one) is detected for certain where
    one element has another age than all others, else in all but one of `base` cases.

    Attributes:
        elements: The clients, the least significant digit first, the check digit last.
        base: The number of contents of an element that are used.
        size: The number of values, which go from 0 to size - 1.
    """

    def __init__(self, elements: Sequence[MemoryClient], base: int = 8) -> None:
        """Make a bank of elements.

        Args:
            elements: Clients on the same node, the least significant digit first; the last one
                holds the check digit.
            base: How many contents of every element are used: at most those that it has.

        Raises:
            ValueError: There are fewer than two elements, or two contents.
        """
        if len(elements) < 2:
            raise ValueError(f'elements must be at least 2; got {len(elements)}')
        if base < 2:
            raise ValueError(f'base must be at least 2; got {base!r}')
        self.elements = tuple(elements)
        self.base, self.size = base, base ** (len(elements) - 1)

    @classmethod
    def on(cls, node: Node, elements: int, namespace: str = '/bank', base: int = 8) -> MemoryBank:
        """Return the bank that `bank.launch.py` or `memory_bank` starts with these arguments;
        `base` as in `MemoryBank`.
        """
        names = [f'{namespace.rstrip("/")}/element_{i}/mlmem' for i in range(elements)]
        return cls([MemoryClient(node, name, actions=False) for name in names], base)

    def encode(self, value: int) -> tuple[int, ...]:
        """Return the digits of a value, the least significant first, the check digit last.

        Raises:
            ValueError: The value is not a whole number from 0 to `size` - 1.
        """
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < self.size:
            raise ValueError(
                f'value must be a whole number from 0 to {self.size - 1}; got {value!r}'
            )
        digits = [value // self.base**i % self.base for i in range(len(self.elements) - 1)]
        return (*digits, -sum(digits) % self.base)

    def decode(self, contents: Sequence[int | None]) -> BankValue:
        """Return the value that the contents of the elements mean.

        Args:
            contents: The content of every element; -1 where it is blank, None where it could not
                be read, which must be at most one.

        Raises:
            BankCheckFailed: The contents do not match the check digit.
        """
        digits = [content for content in contents if content is not None]
        if set(digits) == {BLANK}:
            return BankValue(None, (BLANK,) * len(contents))
        if not all(0 <= digit < self.base for digit in digits):
            raise BankCheckFailed(digits)
        recovered = ''
        if len(digits) < len(contents):
            lost = contents.index(None)
            recovered = self.elements[lost].name
            digits.insert(lost, -sum(digits) % self.base)
        if sum(digits) % self.base != 0:
            raise BankCheckFailed(digits)
        value = sum(digit * self.base**i for i, digit in enumerate(digits[:-1]))
        return BankValue(value, tuple(digits), recovered)

    def ready(self, timeout: float = 10.0) -> Reply[None]:
        """Wait until all elements are available, at most `timeout` seconds."""
        return self._request_all(lambda each: each.ready(timeout), lambda _: None)

    def write(self, value: int, timeout: float = 60.0) -> Reply[BankValue]:
        """Write a value; every element verifies its digit by an echo.

        Args:
            value: 0 ... `size` - 1.
            timeout: Longest wait for the answer in seconds.

        Raises:
            ValueError: The value is out of range.
        """
        digits = dict(zip(self.elements, self.encode(value), strict=True))
        return self._request_all(lambda each: each.write(digits[each], timeout), self.decode)

    def read(self, timeout: float = 10.0, *, end: str = '') -> Reply[BankValue]:
        """Read the value; `end` is the one to probe this time, as in `MemoryClient.read`."""
        return self._request_all(
            lambda each: each.read(timeout, end=end), self.decode, lost_allowed=1
        )

    def erase(self, timeout: float = 60.0) -> Reply[BankValue]:
        """Erase all elements; an erased register holds 0, and so does a bank of registers."""
        return self._request_all(lambda each: each.erase(timeout), self.decode)

    def _request_all(
        self,
        request: Callable[[MemoryClient], Reply[Any]],
        decode: Callable[[Sequence[int | None]], T],
        lost_allowed: int = 0,
    ) -> Reply[T]:
        """Make a request to every element, and decode their contents once all have answered."""
        replies = [request(element) for element in self.elements]

        def decode_contents() -> T:
            errors: dict[str, RequestError] = {}
            contents: list[int | None] = []
            for element, each in zip(self.elements, replies, strict=True):
                try:
                    contents.append(getattr(each.result(0), 'content', None))
                except RequestError as error:
                    errors[element.name] = error
                    contents.append(None)
            if len(errors) > lost_allowed:
                raise BankFailed(errors, len(replies))
            return decode(contents)

        combined = Reply[T](self.elements[0].node)

        def end_if_done(_: object) -> None:
            if all(each.done() for each in replies):
                try:
                    combined.settle(decode_contents())
                except Exception as error:
                    combined.settle(error)

        def give_up_others(_: object) -> None:
            for each in replies:  # whoever cancels the reply of the bank cancels theirs
                each.cancel()

        Future.add_done_callback(combined, give_up_others)
        for each in replies:
            Future.add_done_callback(each, end_if_done)
        return combined
