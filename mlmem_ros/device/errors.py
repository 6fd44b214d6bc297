# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the instrument refuses, and how a procedure fails."""


class SettingsError(ValueError):
    """Settings out of range or inconsistent: the message names setting, value and bound."""


class Refused(Exception):
    """A command that cannot be taken now or at all; the element is unchanged."""


class DriverError(Exception):
    """A real element cannot be reached, or its driver says what cannot be: the device fails."""


class ProcedureFailed(Exception):
    """A procedure that ran and did not reach its aim; the message says what was seen.

    Attributes:
        attempts: Tries it took.
    """

    def __init__(self, message: str, attempts: int = 1) -> None:
        super().__init__(message)
        self.attempts = attempts
