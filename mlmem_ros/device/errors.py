# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the instrument and of procedures."""


class SettingsError(ValueError):
    """Settings out of range or inconsistent: the message names setting, value and bound."""


class Refused(Exception):
    """A command that cannot be accepted, now or ever; the element is unchanged."""


class DriverError(Exception):
    """A real element is unreachable, or its driver returns impossible values: the device fails."""


class ProcedureFailed(Exception):
    """A procedure that ran but failed; the message says what was seen.

    Attributes:
        attempts: Attempts it took.
    """

    def __init__(self, message: str, attempts: int = 1) -> None:
        super().__init__(message)
        self.attempts = attempts
