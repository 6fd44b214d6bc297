# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Results of actions as answers: the client's side of `goals`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from .answers import SelfTested, SomeAnswer, parse_self_test, understood
from .goals import DELAYS, UNKNOWN, fields


def answer_of(name: str, kind: type[SomeAnswer], result: Any, goal: Any) -> SomeAnswer:
    """Return the result of an action, named like its request, as an answer.

    Raises:
        RequestRefused: The node refused the goal.
        RequestFailed: It failed or was canceled.
    """
    if kind is SelfTested and not result.error_code:
        return parse_self_test(result)  # type: ignore[return-value]
    asked = {'asked': goal.level} if hasattr(goal, 'level') else {}
    return understood(kind, not result.error_code, {**said(name, result), **asked})


def said(name: str, result: Any) -> Mapping[str, Any]:
    """Return a result's values by the names of an answer's JSON object."""
    if result.error_code == result.REFUSED:
        return {'error': result.error}
    values = {
        field: None if isinstance(value, float) and math.isnan(value) else value
        for field in fields(result)
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
    return (
        field in ('error_code', *DELAYS.values())
        or (field in ('error', 'reason') and value == '')
        or (field == 'walls' and value == UNKNOWN)
        or (field == 'right_delay' and math.isnan(value))
    )
