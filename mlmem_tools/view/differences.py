# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Differences between two sessions: parameters, commands and outcomes."""

from __future__ import annotations

from difflib import SequenceMatcher
from itertools import zip_longest
from typing import Any

from mlmem_ros.contract import calls
from mlmem_ros.procedures import describe_level

from .session_frame import SessionFrame

MOST = 200
"""Lines shown of each kind."""


def differences(left: SessionFrame, right: SessionFrame) -> dict[str, Any]:
    """Return how two sessions differ.

    Returns:
        `parameters`: name, value left, value right. `events`: those without a counterpart, in
        order; pairs of one of either side, or None. `alike`: how many events agree. `more`: how
        many lines beyond `MOST` of either kind are left out.
    """
    names = sorted({*left.parameters, *right.parameters})
    values = ([name, left.parameters.get(name), right.parameters.get(name)] for name in names)
    parameters = [each for each in values if each[1] != each[2]]
    events: list[tuple[Any, Any]] = []
    alike = 0
    a, b = ([_text(event) for event in each.events] for each in (left, right))
    matcher = SequenceMatcher(a=a, b=b, autojunk=False)
    for tag, i, j, k, end in matcher.get_opcodes():
        if tag == 'equal':
            alike += j - i
        else:
            events += zip_longest(map(_shown, left.events[i:j]), map(_shown, right.events[k:end]))
    return {
        'parameters': parameters[:MOST],
        'events': events[:MOST],
        'alike': alike,
        'more': sum(max(0, len(each) - MOST) for each in (parameters, events)),
    }


def _text(event: dict[str, Any]) -> str:
    """Return the part of an event that must agree: not its time or its delay."""
    values = event.get('values', {})
    kept = [values[key] for key in ('level', 'word', 'attempts') if key in values]
    return ' '.join([event['kind'], event['text'], *kept])


def _shown(event: dict[str, Any]) -> dict[str, Any]:
    values, text = event.get('values', {}), event['text']
    if 'level' in values:
        text = f'{text}, {describe_level(calls.level_of(values))}'
    return {'t': event['t'], 'kind': event['kind'], 'text': text}
