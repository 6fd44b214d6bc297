# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The line to a rig: its layouts, and its rules."""

import dataclasses
import json
from typing import Any

from mlmem.schema import describe_expected
from mlmem_ros.rig import driver, frames

from .table import table

TYPES = {'2s': '2 bytes', 'B': 'u8', 'H': 'u16', 'I': 'u32', 'Q': 'u64', 'd': 'f64'}


PAYLOADS: dict[frames.Kind, tuple[str, frames.Fields, str]] = {
    frames.Kind.HELLO: ('both', (), 'one JSON object; restarts the conversation'),
    frames.Kind.PLAY: ('driver', frames.PLAY_FIELDS, 'numbers V[n m], position[h], velocity[h]'),
    frames.Kind.SAMPLES: ('rig', frames.SAMPLES_FIELDS, 'numbers left[n], right[n]'),
    frames.Kind.AGAIN: (
        'both',
        (),
        'none; its number is not counted: send all frames from it on again',
    ),
    frames.Kind.FAULT: ('rig', (), 'a text: the rig has stopped, and why'),
}
"""Of each kind: who sends it, the fields its payload begins with, and what follows them."""

RULES = """\
**Quantities**

- V is the displacement of the substrate's right end, 0 without strain. `position` and `velocity`
  are those of the held end for the first h set-points of a PLAY; then it is let go. The other end
  is always free.
- Displacements are in units of the rig's `length`; its `zero` is added to those of the ends, in
  SAMPLES and in the `position` of a PLAY, not to V. Velocities are per time unit.
- m is the number of `nodes`: a rig takes m set-points of V, position and velocity in a sample.
- Samples count from 0 in every conversation, and so do set-points: sample k is taken at the end of
  set-point k.
- A frame has whole ticks. A PLAY has `buffer` / 2 samples at most.

**A conversation**

1. The driver sends its HELLO: `{"protocol": 1, "ahead": 0.05}`, where `ahead` is the lead in
   seconds.
2. After every HELLO the rig forgets the last conversation, releases the ends, brings the strain
   slowly to zero, and answers with its own HELLO.
3. The driver sends set-points for `ahead` seconds. The rig plays them as soon as it has that many,
   or when the first has waited that long.
4. The rig sends samples as it takes them, a tick or more in a frame. The driver sends new
   set-points for as many.
5. When the rig runs out of set-points, it holds strain and held end, and counts. These samples get
   no number; the next SAMPLES says how many they were. The rig then waits for `ahead` seconds of
   set-points again.
6. When the driver has gone, the rig releases the ends and brings the strain slowly to zero. A rig
   on a serial line takes a second of silence while the element is strained for that, and ends with
   a FAULT. A driver that has nothing to send, because its device computes, sends an AGAIN from the
   first frame that is not due yet, four times a second and for `patience` seconds: it requests
   nothing, and tells that the driver is there.

**Lost frames.** Each side takes frames in order. It drops a frame with another number than the
one it expects, and if that number was greater, requests the expected one by AGAIN. After a silence
a driver repeats its last frame and requests the next; without a HELLO, on a serial line, it
sends zeros first, which complete what a killed driver left of a frame. A rig keeps the frames of
its last `buffer` samples to send them again; on TCP it need not, and may ignore AGAIN."""


def _meaning(field: dataclasses.Field[Any]) -> str:
    """Return the text of a declared field, and what a single value must be."""
    given = field.metadata['description']
    kind = str(field.type)
    return given.text + (
        f' ({describe_expected(kind, given)})' if kind in ('int', 'float', 'str') else ''
    )


def rig_page() -> str:
    """Return the protocol."""
    payload = [['', 'payload']]
    frame = [*_fields(frames.HEADER_FIELDS), *payload, *_fields(frames.CHECK_FIELDS)]
    kinds = [
        [f'{kind} {kind.name}', sender, '; '.join((*map(' '.join, _fields(fields)), rest))]
        for kind, (sender, fields, rest) in PAYLOADS.items()
    ]
    keys = [
        [
            f'`{field.name}`',
            '' if field.default is dataclasses.MISSING else f'`{json.dumps(field.default)}`',
            _meaning(field),
        ]
        for field in dataclasses.fields(frames.Hello)
    ]
    return (
        '# The line to a rig\n\n'
        'What a program around a [real element](../drivers.md) receives and sends, on TCP as on a '
        'serial line. `examples/rig` has complete rigs in Python and C99.\n\n'
        '## The address\n\n'
        '`tcp://HOST:PORT` or `serial:///dev/PORT?baud=BAUD`. Options follow a `?`: `lead`, the '
        f'seconds that set-points are sent ahead (default {driver.LEAD_TIME_S:g}; more than the '
        f'round '
        'trip, and twice that where frames get lost), and `patience`, the seconds after which a '
        f'silent rig counts as failed (default {driver.LINE_TIMEOUT_S:g}). Each look at the ends '
        f'costs '
        'one lead.\n\n'
        '## A frame\n\n'
        f'Little-endian, without padding:\n\n{table(["type", "content"], frame)}\n\n'
        f"The CRC-32 is zlib's. A payload has at most {frames.MAX_PAYLOAD_BYTES} bytes. Bytes "
        f'that are '
        'no frame are skipped, one by one.\n\n'
        f'## Payloads\n\n{table(["kind", "from", "payload"], kinds)}\n\n'
        'Numbers have the type `numbers` of the HELLO.\n\n'
        "## The rig's HELLO\n\n"
        'A JSON object. A driver refuses an unknown key and a wrong value, and names it.\n\n'
        f'{table(["key", "default", "must be"], keys)}\n\n'
        f'## Rules\n\n{RULES}\n'
    )


def _fields(fields: frames.Fields) -> list[list[str]]:
    return [[TYPES[code], meaning] for code, meaning in fields]
