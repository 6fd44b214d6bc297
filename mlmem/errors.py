# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All errors: why something from outside is rejected and how a procedure ended, with their codes,
and how the sentences of rejections are made.

A test asserts code and field, never the sentence.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from .schema import find_problems, make_printable, short_repr

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

    INACTIVE = 'inactive'
    """No time runs: the node is not active, or ends, or its device has stopped after a failure."""

    OTHER = 'other'
    """None of these; the sentence says it."""


SENTENCES = {
    ErrorCode.UNKNOWN_FIELD: 'there is no {field}; there are {expected}',
    ErrorCode.MISSING_FIELD: '{field} must be given: {expected}',
}
"""The sentences of rejections without a reason that do not say what a value must be."""


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
        reason: What prevents it, where no value does: a failure, or what is under way.
        place: Where it stands, such as a file and a line; empty if it is from no file.
    """

    def __init__(
        self,
        code: ErrorCode = ErrorCode.OTHER,
        field: str = '',
        value: object = None,
        expected: str = '',
        reason: str = '',
        place: str = '',
    ) -> None:
        super().__init__(code, field, value, expected, reason, place)  # to be pickled
        self.code, self.field, self.value, self.expected = code, field, value, expected
        self.reason, self.place = reason, place

    def __str__(self) -> str:
        """Return the sentence, of one line and at most `MAX_MESSAGE_CHARS` characters."""
        parts = [self.place, self.field, self.reason]
        if not self.reason:
            form = SENTENCES.get(self.code, '{field} must be {expected}; got {value}')
            value = short_repr(self.value)
            sentence = form.format(field=self.field or 'it', expected=self.expected, value=value)
            parts = [self.place, sentence]
        return make_printable(': '.join(filter(None, parts)))

    @classmethod
    def out_of_range(cls, field: str, value: object, expected: str) -> Self:
        """Return the rejection of a value that is not what it must be, whatever else there is."""
        return cls(ErrorCode.OUT_OF_RANGE, field, value, expected)

    @classmethod
    def of_error(
        cls,
        error: Exception,
        owner: str = '',
        place: str = '',
        code: ErrorCode = ErrorCode.OTHER,
    ) -> Self:
        """Return the rejection that an error is.

        Args:
            error: A rejection keeps its code; of any other error, the text is the reason.
            owner: Name of the group that has the field.
            place: The file.
            code: Of an error that is no rejection.
        """
        if not isinstance(error, Rejected):
            error = Rejected(code, reason=str(error))
        field = '.'.join(filter(None, (owner, error.field)))
        place = ': '.join(filter(None, (place, error.place)))
        return cls(error.code, field, error.value, error.expected, error.reason, place)


class DesignError(Rejected, ValueError):
    """A design out of range or inconsistent: the message names symbol, value and bound."""


class StateError(Rejected, ValueError):
    """Arrays that are not a state of this chain: wrong shape, not finite, wrong kind."""


class SettingsError(Rejected, ValueError):
    """Settings out of range or inconsistent."""


@dataclass(frozen=True)
class Checked:
    """A group of settings that refuses values out of range when it is made."""

    def __post_init__(self) -> None:
        for problem in find_problems(self):
            raise SettingsError.out_of_range(*problem)


class Refused(Rejected):
    """A command that is not accepted; the element is unchanged."""


class DriverError(Exception):
    """A real element that is unreachable, or whose driver returns impossible values."""


class DriverHangs(DriverError):
    """A driver that does not return: it cannot be closed, so it is not opened again."""


class ProcedureFailed(Exception):
    """A procedure that ran and failed; the message says what was observed.

    The code of its outcome follows from its last reading (`find_failure_code`).

    Attributes:
        attempts: How often it was tried.
    """

    def __init__(self, message: str, attempts: int = 1) -> None:
        super().__init__(message)
        self.attempts = attempts


class Astray(ProcedureFailed):
    """An end rests too far from either phase to be driven about its rest."""


class NotFollowed(ProcedureFailed):
    """The actuator does not follow its set-point."""
