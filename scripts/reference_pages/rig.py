# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The line to a rig: its layouts, and its rules."""

import dataclasses
import json
from collections.abc import Iterable, Sequence
from typing import Any

from mlmem.schema import describe_expected
from mlmem_ros.rig import driver, frames

from .table import make_table

TYPE_NAMES = {'2s': '2 bytes', 'B': 'u8', 'H': 'u16', 'I': 'u32', 'Q': 'u64', 'd': 'f64'}


PAYLOAD_FIELDS: dict[frames.FrameKind, tuple[str, Sequence[frames.Field], str]] = {
    frames.FrameKind.HELLO: ('both', (), 'one JSON object; restarts the conversation'),
    frames.FrameKind.PLAY: (
        'driver',
        frames.Layout.PLAY.fields,
        'numbers V[n m], position[h], velocity[h]',
    ),
    frames.FrameKind.SAMPLES: ('rig', frames.Layout.SAMPLES.fields, 'numbers left[n], right[n]'),
    frames.FrameKind.AGAIN: (
        'both',
        (),
        'none; its number is not counted: send all frames from it on again',
    ),
    frames.FrameKind.FAULT: ('rig', (), 'a text: the rig has stopped, and why'),
}
"""Of each kind: who sends it, the fields its payload begins with, and what follows them."""


def _describe_field(field: dataclasses.Field[Any]) -> str:
    """Return the text of a declared field, and what a single value must be."""
    given = field.metadata['description']
    kind = str(field.type)
    return given.text + (
        f' ({describe_expected(kind, given)})' if kind in ('int', 'float', 'str') else ''
    )


def generate_rig() -> dict[str, str]:
    """Return the frames of the protocol, and its limits."""
    payload = [['', 'payload']]
    frame = [
        *_list_fields(frames.Layout.HEADER.fields),
        *payload,
        *_list_fields(frames.Layout.CHECK.fields),
    ]
    kinds = [
        [f'{kind} {kind.name}', sender, '; '.join((*map(' '.join, _list_fields(fields)), rest))]
        for kind, (sender, fields, rest) in PAYLOAD_FIELDS.items()
    ]
    keys = [
        [
            f'`{field.name}`',
            '' if field.default is dataclasses.MISSING else f'`{json.dumps(field.default)}`',
            _describe_field(field),
        ]
        for field in dataclasses.fields(frames.Hello)
    ]
    limits = [
        ['`lead` of the address', f'{driver.Rig.default_lead:g} s'],
        ['`patience` of the address', f'{driver.Rig.default_patience:g} s'],
        ['longest payload', f'{frames.Parser.max_payload_bytes} bytes'],
    ]
    return {
        'limits': make_table(['quantity', 'value'], limits),
        'frame': make_table(['type', 'content'], frame),
        'payloads': make_table(['kind', 'from', 'payload'], kinds),
        'hello': make_table(['key', 'default', 'must be'], keys),
    }


def _list_fields(fields: Iterable[frames.Field]) -> list[list[str]]:
    return [[TYPE_NAMES[code], meaning] for code, meaning in fields]
