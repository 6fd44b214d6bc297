# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a request ended, as a memory node answers it: values by name, and one JSON object."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..device import Outcome


def ended(outcome: Outcome) -> dict[str, Any]:
    """Return the published values of a finished procedure, by name.

    It adds the contract's single `margin`: how far the delay is from the next level.
    """
    values = outcome.as_dict()
    if 'level_margin' in values:
        values['margin'] = values['level_margin']
    return values


def answer(outcome: Outcome, **asked: Any) -> str:
    """Return the JSON object that answers a service, along with what was asked for."""
    return json.dumps(ended(outcome) | asked)


def refusal(reason: object, **asked: Any) -> str:
    """Return the JSON object that answers a refused request, with what was asked for."""
    return json.dumps({'error': str(reason)} | asked)
