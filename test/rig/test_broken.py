# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A broken rig or driver: each fault ends in an error that names it, never in a level.

What is put right on the way (frames lost, damaged, repeated, out of order) is in test_rig.py.
"""

import dataclasses
import json
import math
import struct

import numpy as np
import pytest

from mlmem import DriverError, MemoryElement, Read
from mlmem.physics import CASE_II
from mlmem_ros.rig.frames import FrameKind, Layout, encode_frame

from .lines import LocalDriver, TamperedLine, driven, emulated, encode, raising


def repack(change):
    """Return a function that replaces the payload of a frame by what a function makes of it."""
    return lambda frame: encode_frame(frame.kind, frame.number, change(frame.payload))


def shift_samples(payload):
    first, *rest = Layout.SAMPLES.unpack_from(payload)
    return Layout.SAMPLES.pack(first - 40, *rest) + payload[Layout.SAMPLES.size :]


def repeat_samples(payload):
    first, samples, *rest = Layout.SAMPLES.unpack_from(payload)
    more = np.tile(np.frombuffer(payload[Layout.SAMPLES.size :]), 1000).tobytes()
    return Layout.SAMPLES.pack(first, 1000 * samples, *rest) + more


def replace_sample(number):
    """Return a function that replaces the first sample."""
    begin = Layout.SAMPLES.size
    return lambda payload: payload[:begin] + struct.pack('<d', number) + payload[begin + 8 :]


def zero_header_crc(frame):
    data = encode(frame)
    return data[:15] + b'\0\0' + data[17:]


MALFORMED = {
    'damaged': (lambda frame: encode(frame)[:-1] + b'?', r'ends with the CRC 0x\w{8}'),
    'wrong_kind': (
        lambda frame: encode_frame(9, frame.number, frame.payload), 'a frame of kind 9'
    ),
    'wrong_number': (
        lambda frame: encode_frame(frame.kind, frame.number + 1, frame.payload), 'has number'
    ),
    'header_crc': (zero_header_crc, 'a header ends with the CRC 0x0000'),
    'too_long': (lambda frame: Layout.HEADER.pack(b'mR', 3, 0, 2**31, 0), 'got 2147483648'),
    'no_frame': (lambda frame: b'Hello from the rig!\r\n', "no frame begins with b'"),
}  # fmt: skip
"""What is wrong with a frame, and what the error says of it."""
BROKEN = MALFORMED | {
    'silent': (lambda frame: b'', 'the rig has been silent for 0.05 s'),
    'shorter': (repack(lambda payload: payload[:-8]), '632 bytes for 40 samples'),
    'no_head': (repack(lambda payload: payload[:5]), 'wrong length: 5 bytes'),
    'earlier': (repack(shift_samples), r'sent samples \d+ to \d+'),
    'not_played_yet': (repack(repeat_samples), r'sent samples \d+ to \d+'),
    'nan': (repack(replace_sample(math.nan)), 'NaN or infinity'),
    'far_away': (repack(replace_sample(1e9)), 'at most 1e6 cells'),
    'stopped': (
        lambda frame: encode_frame(FrameKind.FAULT, frame.number, b'the grip\n\x1b[2J'),
        r'the rig has stopped: the grip\\n\\x1b\[2J',
    ),
    'another_kind': (
        lambda frame: encode_frame(FrameKind.PLAY, frame.number, frame.payload), 'sent PLAY'
    ),
    'begun_anew': (lambda frame: encode_frame(FrameKind.AGAIN, 0), 'it has restarted'),
    'hung_up': (raising(EOFError('the line is closed')), 'the line is closed'),
    'line_broken': (raising(OSError(5, 'Input/output error')), 'Input/output error'),
}  # fmt: skip


def tampered(tamper, after):
    """Return a line that tampers with the frames of its rig after so many."""
    line, seen = TamperedLine(emulated()), []

    def outward(frame):
        seen.append(frame)
        return tamper(frame) if len(seen) > after else encode(frame)

    line.outward = outward
    return line


def live(element):
    """Let time pass without an event."""
    for _ in range(60):
        assert not element.advance()


@pytest.mark.parametrize('name', BROKEN)
@pytest.mark.parametrize('after', [3, 40], ids=['at rest', 'under a read'])
def test_broken_rig_is_reported(name, after):
    """The running read fails, and the content is then unknown."""
    tamper, why = BROKEN[name]
    line = tampered(tamper, after)
    element = driven(line)
    element.apply(Read())
    with pytest.raises(DriverError, match=why):
        live(element)
    assert not element.procedure
    assert element.reading is None
    (outcome,) = element._events
    assert not outcome.success
    if name != 'far_away':  # a rig that can still be talked to
        assert line.closed
        with pytest.raises(DriverError, match=why):  # and it stays so
            element.advance()


@pytest.mark.parametrize('name', MALFORMED)
def test_malformed_hello_is_explained(name):
    """Whoever writes a rig sees what is wrong with its first frame."""
    tamper, why = MALFORMED[name]
    with pytest.raises(DriverError, match=why):
        driven(tampered(tamper, 0))


@pytest.mark.parametrize(
    ('hello', 'field'),
    [
        (b'HTTP/1.1 400', 'JSON'),
        (b'[1]', 'object'),
        ({'protocol': 2}, 'protocol'),
        ({'dt': -1.0}, 'dt'),
        ({'samples': 40_000_000, 'dt': 5e-7}, 'samples'),
        ({'buffer': 250}, 'device.address must be a lead'),
        ({'nodes': [0.5]}, 'nodes'),
        ({'nodes': []}, 'nodes'),
        ({'nodes': [k / 200_000 for k in range(1, 200_001)]}, 'nodes'),
        ({'numbers': '<c16'}, 'numbers'),
        ({'zero': 0.0}, 'zero'),
        ({'zero': [5.0, 0.0]}, 'zero'),
        ({'can': ['strain', 'left']}, 'can must be left and right'),
        ({'can': 'everything'}, 'can'),
    ],
    ids=lambda value: str(value)[:30],
)
def test_invalid_hello_is_rejected_by_field(hello, field):
    rig = emulated()
    values = dataclasses.asdict(rig._hello)
    text = hello if isinstance(hello, bytes) else json.dumps(values | hello).encode()
    tamper = repack(lambda _: text)
    line = TamperedLine(
        rig, outward=lambda each: (tamper if each.kind == FrameKind.HELLO else encode)(each)
    )
    with pytest.raises((DriverError, ValueError), match=field):
        driven(line)
    assert line.closed


@pytest.mark.parametrize(
    ('breaks', 'why'),
    [
        (lambda ends: ends[:, :-1], r'shape \(2, 39\)'),
        (lambda ends: ends[0], r'shape \(40,\)'),
        (lambda ends: ends * np.nan, 'NaN'),
        (lambda ends: ends * np.inf, 'NaN'),
        (raising(OSError('no such device')), 'the driver failed: no such device'),
    ],
)
def test_samples_of_any_driver_are_checked(breaks, why):
    driver = LocalDriver()
    advance = driver.advance
    driver.advance = lambda *given: breaks(advance(*given))
    element = MemoryElement(CASE_II, driver=driver)
    element.apply(Read())
    with pytest.raises(DriverError, match=why):
        element.advance()
    assert element.reading is None
