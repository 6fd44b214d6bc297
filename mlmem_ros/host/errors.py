# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors that answer a request."""

from __future__ import annotations

from ..bag.errors import BagError
from ..device import DriverError, Refused, SettingsError
from ..physics import DesignError, StateError


class Overdue(Exception):
    """The disk does not answer: the work may or may not still complete."""

    def __init__(self, what: str, seconds: float) -> None:
        super().__init__(f'{what} takes longer than {seconds:g} s: the disk does not answer')


REFUSALS = (Refused, DriverError, DesignError, SettingsError, StateError, BagError, Overdue)
"""Expected errors, with a message for the user; any other is a fault in the software."""
