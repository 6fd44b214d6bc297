# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The line to a rig: its layouts, and the rules in the docstring of the package."""

import dataclasses
import inspect
import json

from mlmem_ros import rig
from mlmem_ros.rig import driver, frames, hello

from .table import table

TYPES = {'2s': '2 bytes', 'B': 'u8', 'H': 'u16', 'I': 'u32', 'Q': 'u64', 'd': 'f64'}


def rig_page() -> str:
    """Return the protocol: its layouts, and the rules in the docstring of the package."""
    _, rules = (inspect.getdoc(rig) or '').split('\n\n', 1)
    payload = [['', 'payload']]
    frame = [*_fields(frames.HEADER_FIELDS), *payload, *_fields(frames.CHECK_FIELDS)]
    kinds = [
        [f'{kind} {kind.name}', sender, '; '.join((*map(' '.join, _fields(fields)), rest))]
        for kind, (sender, fields, rest) in frames.PAYLOADS.items()
    ]
    keys = [
        [
            f'`{field.name}`',
            '' if field.default is dataclasses.MISSING else f'`{json.dumps(field.default)}`',
            hello.WANTED[field.name][0],
        ]
        for field in dataclasses.fields(hello.Hello)
    ]
    return (
        '# The line to a rig\n\n'
        'What a program around a [real element](../drivers.md) receives and sends, on TCP as on a '
        'serial line. `examples/rig` has complete rigs in Python and C99.\n\n'
        '## The address\n\n'
        '`tcp://HOST:PORT` or `serial:///dev/PORT?baud=BAUD`. Options follow a `?`: `lead`, the '
        f'seconds that set-points are sent ahead (default {driver.LEAD:g}; more than the round '
        'trip, and twice that where frames get lost), and `patience`, the seconds after which a '
        f'silent rig counts as failed (default {driver.PATIENCE:g}). Each look at the ends costs '
        'one lead.\n\n'
        '## A frame\n\n'
        f'Little-endian, without padding:\n\n{table(["type", "content"], frame)}\n\n'
        f"The CRC-32 is zlib's. A payload has at most {frames.MOST_PAYLOAD} bytes. Bytes that are "
        'no frame are skipped, one by one.\n\n'
        f'## Payloads\n\n{table(["kind", "from", "payload"], kinds)}\n\n'
        'Numbers have the type `numbers` of the HELLO.\n\n'
        "## The rig's HELLO\n\n"
        'A JSON object. A driver refuses an unknown key and a wrong value, and names it.\n\n'
        f'{table(["key", "default", "must be"], keys)}\n\n'
        f'## Rules\n\n{rules}\n'
    )


def _fields(fields: frames.Fields) -> list[list[str]]:
    return [[TYPES[code], meaning] for code, meaning in fields]
