# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the instrument and of procedures, and settings that raise theirs."""

from __future__ import annotations

from dataclasses import dataclass

from .rejections import Rejected
from .schema import find_problems


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
