# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Differences between two sessions: parameters, requests and results."""

from __future__ import annotations

from difflib import SequenceMatcher
from typing import Any

from .recorded import Recorded

MOST = 200
"""Lines shown of each kind."""


def differences(left: Recorded, right: Recorded) -> dict[str, Any]:
    """Return what differs.

    Args:
        left: A session.
        right: Another one.

    Returns:
        `parameters`: name, value left, value right. `events`: those without a counterpart on the
        other side, with times, in order. `alike`: how many events agree.
    """
    names = sorted({*left.parameters, *right.parameters})
    parameters = [
        [name, left.parameters.get(name), right.parameters.get(name)]
        for name in names
        if left.parameters.get(name) != right.parameters.get(name)
    ]
    texts = [[_text(event) for event in each.events] for each in (left, right)]
    events: list[dict[str, Any]] = []
    alike = 0
    matcher = SequenceMatcher(a=texts[0], b=texts[1], autojunk=False)
    for tag, a, b, c, d in matcher.get_opcodes():
        if tag == 'equal':
            alike += b - a
            continue
        for row in range(max(b - a, d - c)):
            events.append(
                {
                    'left': _shown(left, a + row) if row < b - a else None,
                    'right': _shown(right, c + row) if row < d - c else None,
                }
            )
    return {'parameters': parameters[:MOST], 'events': events[:MOST], 'alike': alike}


def _text(event: dict[str, Any]) -> str:
    """Return the part of an event that must agree: not its time or its delay."""
    values = event.get('values', {})
    kept = [values[key] for key in ('level', 'attempts') if key in values]
    return ' '.join([event['kind'], event['text'], *kept])


def _shown(session: Recorded, index: int) -> dict[str, Any]:
    event = session.events[index]
    level = event.get('values', {}).get('level')
    text = event['text'] if level is None else f'{event["text"]}, level {level}'
    return {'t': event['t'], 'kind': event['kind'], 'text': text}
