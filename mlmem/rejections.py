# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why something from outside is rejected, and how a procedure ended: all codes, and how the
sentences of rejections are made.

A test asserts code and field, never the sentence.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any

from .schema import Problem

if TYPE_CHECKING:
    from typing_extensions import Self


class ErrorCode(str, Enum):
    """Why something is rejected."""

    OUT_OF_RANGE = 'out_of_range'
    """The value is not of its type, or not within its range or choices."""

    CONFLICT = 'conflict'
    """The value is right alone, but does not fit another one."""

    UNSUPPORTED = 'unsupported'
    """The element cannot do it, whatever the value."""

    UNKNOWN_FIELD = 'unknown_field'
    """There is no field of this name."""

    MISSING_FIELD = 'missing_field'
    """A field that has no default is missing."""

    MALFORMED = 'malformed'
    """A text is not JSON or YAML."""

    UNREADABLE = 'unreadable'
    """A file cannot be read."""

    BUSY = 'busy'
    """A procedure runs, or too many requests wait: the same request can succeed later."""

    OTHER = 'other'
    """None of these; the sentence says it."""


class OutcomeCode(str, Enum):
    """How a procedure ended."""

    OK = 'ok'
    """It succeeded."""

    ABORTED = 'aborted'
    """It was stopped."""

    UNDECODABLE = 'undecodable'
    """It failed because the last echo could not be decoded."""

    FAILED = 'failed'
    """It failed for another reason; the sentence says it."""

    def __str__(self) -> str:
        return self.value


class Rejected(Exception):
    """Something from outside that is not accepted; nothing has changed.

    Attributes:
        code: Why.
        field: What is wrong, such as `kick.speeds`; empty if it is not a field.
        value: The value that it has.
        expected: What it must be, in words, with unit and range.
    """

    def __init__(
        self,
        message: str,
        code: ErrorCode = ErrorCode.OTHER,
        field: str = '',
        value: object = None,
        expected: str = '',
    ) -> None:
        super().__init__(message)
        self.code, self.field, self.value, self.expected = code, field, value, expected

    @classmethod
    def of_value(cls, code: ErrorCode, field: str, value: object, expected: str) -> Self:
        """Return the rejection of a value, with its sentence."""
        message = str(Problem(field, value, expected))
        return cls(message, code=code, field=field, value=value, expected=expected)

    @classmethod
    def out_of_range(cls, field: str, value: object, expected: str) -> Self:
        """Return the rejection of a value that is not what it must be, whatever else there is."""
        return cls.of_value(ErrorCode.OUT_OF_RANGE, field, value, expected)

    @classmethod
    def of_problems(
        cls, problems: Sequence[Problem], code: ErrorCode = ErrorCode.OUT_OF_RANGE
    ) -> Self:
        """Return the rejection of several values: all sentences, and the first field."""
        field, value, expected = problems[0]
        message = '; '.join(map(str, problems))
        return cls(message, code=code, field=field, value=value, expected=expected)

    @classmethod
    def name_owner(cls, owner: str, error: Exception) -> Self:
        """Return the rejection of what a group or a file holds; `owner` is its name."""
        if not isinstance(error, Rejected):
            return cls(f'{owner}: {error}', field=owner)
        more: dict[str, Any] = {'value': error.value, 'expected': error.expected}
        if not error.field:
            return cls(f'{owner}: {error}', code=error.code, field=owner, **more)
        field = f'{owner}.{error.field}'
        return cls(f'{owner}.{error}', code=error.code, field=field, **more)
