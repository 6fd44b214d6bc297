# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actions: their types, and outcomes as their results.

Their types come from the package `mlmem_interfaces`, which is optional.
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..procedures import PROCEDURES
from ..words import UNDECODABLE
from .outcomes import ended

if TYPE_CHECKING:
    from ..device import Outcome

ACTIONS = {name: row.command.__name__ for name, row in PROCEDURES.items() if row.action}
"""The requests that are also actions, with the names of their types."""

DELAYS = {'left': 'left_delays', 'right': 'right_delays'}
"""Field of the delays that a calibration measures, by end."""

UNKNOWN = -1
"""Number of walls when a single end cannot determine it."""


def action_types() -> dict[str, Any]:
    """Return the types of `ACTIONS` by request; none if the interfaces are not built."""
    try:
        module = import_module('mlmem_interfaces.action')
    except ImportError:  # a checkout has their source, without types
        return {}
    return {name: getattr(module, kind) for name, kind in ACTIONS.items() if hasattr(module, kind)}


def result_of(kind: Any, outcome: Outcome, error_code: int) -> Any:
    """Return a procedure's outcome as the result of an action, with an error code of
    `kind.Result`.
    """
    values = ended(outcome)
    for end, name in DELAYS.items():
        values[name] = list(outcome.delays.get(end, ()))
    values['error'] = outcome.error if error_code else ''
    result = failed(kind, error_code, values['error'])
    for name in fields(result):
        if values.get(name) is not None:
            setattr(result, name, values[name])
    return result


def failed(kind: Any, error_code: int, error: str) -> Any:
    """Return the result of an action with nothing but an error."""
    result = kind.Result(error_code=error_code, error=error)
    if hasattr(result, 'level'):
        result.level, result.walls = UNDECODABLE, UNKNOWN
        result.delay = result.right_delay = math.nan
    return result


def fields(message: Any) -> list[str]:
    """Return the names of the fields of a message."""
    return list(message.get_fields_and_field_types())
