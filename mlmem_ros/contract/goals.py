# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The actions: goals to requests, outcomes to results, and results to answers.

Their types come from the package `mlmem_interfaces`, which is optional.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..procedures import PROCEDURES
from ..words import UNDECODABLE
from .answers import SelfTested, SomeAnswer, ended, parse_self_test, understood

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
    """Return a procedure's outcome as the result of an action.

    Args:
        kind: The action.
        outcome: The outcome of its procedure.
        error_code: One of `kind.Result`; `NONE` for success.
    """
    values = ended(outcome)
    for end, name in DELAYS.items():
        values[name] = list(outcome.delays.get(end, ()))
    values['error'] = outcome.error if error_code else ''
    result = failed(kind, error_code, values['error'])
    for name in _fields(result):
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


def answer_of(name: str, kind: type[SomeAnswer], result: Any, goal: Any) -> SomeAnswer:
    """Return the result of an action as an answer.

    Args:
        name: The request.
        kind: The type of a successful answer.
        result: Result of the action.
        goal: Its goal.

    Raises:
        RequestRefused: The node refused the goal.
        RequestFailed: It failed or was canceled.
    """
    if kind is SelfTested and not result.error_code:
        return parse_self_test(result)  # type: ignore[return-value]
    asked = {'asked': goal.level} if hasattr(goal, 'level') else {}
    return understood(kind, not result.error_code, {**said(name, result), **asked})


def said(name: str, result: Any) -> Mapping[str, Any]:
    """Return a result's values by the names of an answer's JSON object.

    Args:
        name: The request.
        result: Result of its action.
    """
    if result.error_code == result.REFUSED:
        return {'error': result.error}
    values = {
        field: None if isinstance(value, float) and math.isnan(value) else value
        for field in _fields(result)
        if not _is_absent(field, value := getattr(result, field))
    }
    values['procedure'] = name
    if 'margin' in values:
        values['level_margin'] = values['margin']
    measured = {end: list(getattr(result, field, ())) for end, field in DELAYS.items()}
    if any(measured.values()):
        values['delays'] = {end: delays for end, delays in measured.items() if delays}
    return values


def _is_absent(field: str, value: Any) -> bool:
    """Return whether an answer leaves out this field."""
    return (
        field in ('error_code', *DELAYS.values())
        or (field in ('error', 'reason') and value == '')
        or (field == 'walls' and value == UNKNOWN)
        or (field == 'right_delay' and math.isnan(value))
    )


def _fields(message: Any) -> list[str]:
    return list(message.get_fields_and_field_types())
