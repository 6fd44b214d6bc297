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

from mlmem import Driver, DriverError, Loop, MemoryElement, Read, Refused, Settings, Write
from mlmem.instrument.drivers import Simulation
from mlmem.physics import CASE_II
from mlmem_ros.rig.frames import HEADER_LAYOUT, SAMPLES_LAYOUT, FrameKind, encode_frame

from .lines import TamperedLine, calibration, driven, emulated


def repack(change):
    """Return a function that replaces the payload of a frame by what a function makes of it."""
    return lambda frame: encode_frame(frame.kind, frame.number, change(frame.payload))


def shift_samples(payload):
    first, *rest = SAMPLES_LAYOUT.unpack_from(payload)
    return SAMPLES_LAYOUT.pack(first - 40, *rest) + payload[SAMPLES_LAYOUT.size :]


def repeat_samples(payload):
    first, samples, *rest = SAMPLES_LAYOUT.unpack_from(payload)
    more = np.tile(np.frombuffer(payload[SAMPLES_LAYOUT.size :]), 1000).tobytes()
    return SAMPLES_LAYOUT.pack(first, 1000 * samples, *rest) + more


def replace_sample(number):
    """Return a function that replaces the first sample."""
    begin = SAMPLES_LAYOUT.size
    return lambda payload: payload[:begin] + struct.pack('<d', number) + payload[begin + 8 :]


def fail(error):
    """Return a function that raises an error."""

    def fail(frame):
        raise error

    return fail


def zero_header_crc(frame):
    data = encode_frame(*frame)
    return data[:15] + b'\0\0' + data[17:]


MALFORMED = {
    'damaged': (
        lambda frame: encode_frame(*frame)[:-1] + b'?',
        r'silent for 0.05 s; a frame of kind \d and \d+ bytes ends with the CRC 0x\w{8}; expected',
    ),
    'wrong_kind': (
        lambda frame: encode_frame(9, frame.number, frame.payload),
        'the rig sent a frame of kind 9; known are 1 HELLO, 2 PLAY, 3 SAMPLES, 4 AGAIN',
    ),
    'wrong_number': (
        lambda frame: encode_frame(frame.kind, frame.number + 1, frame.payload),
        r'silent for 0.05 s; a frame has number \d+; expected \d+',
    ),
    'header_crc': (
        zero_header_crc,
        r'silent for 0.05 s; a header ends with the CRC 0x0000; expected 0x\w{4}',
    ),
    'too_long': (
        lambda frame: HEADER_LAYOUT.pack(b'mR', 3, 0, 2**31, 0),
        'silent for 0.05 s; a payload may have at most 4194304 bytes; got 2147483648',
    ),
    'no_frame': (lambda frame: b'Hello from the rig!\r\n', r"no frame begins with b'"),
}
BROKEN = MALFORMED | {
    'silent': (lambda frame: b'', 'the rig has been silent for 0.05 s'),
    'shorter': (
        repack(lambda payload: payload[:-8]),
        'the rig sent samples of the wrong length: 632 bytes for 40 samples of both ends',
    ),
    'no_head': (
        repack(lambda payload: payload[:5]),
        'the rig sent samples of the wrong length: 5 bytes',
    ),
    'earlier': (
        repack(shift_samples),
        r'the rig sent samples \d+ to \d+; expected \d+ to at most \d+',
    ),
    'not_played_yet': (
        repack(repeat_samples),
        r'the rig sent samples \d+ to \d+; expected \d+ to at most \d+',
    ),
    'nan': (
        repack(replace_sample(math.nan)),
        r'the rig sent NaN or infinity among the samples from \d+',
    ),
    'far_away': (
        repack(replace_sample(1e9)),
        'the driver must return displacements of at most 1e6 cells; got more, or NaN',
    ),
    'stopped': (
        lambda frame: encode_frame(FrameKind.FAULT, frame.number, b'the grip is stuck\n\x1b[2J'),
        r'the rig has stopped: the grip is stuck\\n\\x1b\[2J',
    ),
    'another_kind': (
        lambda frame: encode_frame(FrameKind.PLAY, frame.number, frame.payload),
        'the rig sent PLAY instead of samples',
    ),
    'begun_anew': (
        lambda frame: encode_frame(FrameKind.AGAIN, 0),
        'the rig requests frames that it has answered: it has restarted',
    ),
    'hung_up': (
        fail(EOFError('the rig has closed the connection')),
        'the rig has closed the connection',
    ),
    'line_broken': (fail(OSError(5, 'Input/output error')), 'Input/output error'),
}


def tampered(tamper, after):
    """Return a line that tampers with the frames of its rig after so many."""
    line, seen = TamperedLine(emulated()), []

    def outward(frame):
        seen.append(frame)
        return tamper(frame) if len(seen) > after else encode_frame(*frame)

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


def test_broken_rig_ends_every_wait():
    line, failed = TamperedLine(emulated()), []
    element = driven(line)
    loop = Loop(element, lambda *_: None, speed=0.0, failed=lambda: failed.append(True))
    line.outward = lambda frame: b''
    answers = [loop.submit(Write(3)).answer, loop.call(lambda: None)]
    loop.start()
    with pytest.raises(Refused, match=r'the device has stopped: .*the rig has been silent'):
        answers[0].result(10.0)
    loop.stop()
    assert failed
    assert isinstance(loop.failure, DriverError)


@pytest.mark.parametrize(
    ('said', 'why'),
    [
        (b'HTTP/1.1 400', 'the hello of the rig: it must be JSON; '),
        (b'[1]', 'the hello of the rig: it must be an object; got a list'),
        ({'protocol': 2}, 'the rig uses protocol version 2, this driver 1'),
        (
            {'colour': 'red'},
            "the hello of the rig: there is no 'colour'; there are protocol, ",
        ),
        ({'dt': -1.0}, 'hello of the rig: dt must be a finite number from 1e-15 .*; got -1.0'),
        ({'dt': math.nan}, 'the hello of the rig: it must be JSON; NaN is not JSON'),
        ({'seconds': None}, 'hello of the rig: seconds must be .*; got None'),
        ({'length': '1 mm'}, "hello of the rig: length must be .*; got '1 mm'"),
        ({'force': 10**400}, 'hello of the rig: force must be .*; got 1000'),
        ({'samples': 80.5}, 'hello of the rig: samples must be a whole .*; got 80.5'),
        ({'buffer': True}, 'hello of the rig: buffer must be a whole .*; got True'),
        ({'nodes': [0.5]}, r'hello of the rig: nodes must be .*; got \(0.5,\)'),
        ({'nodes': []}, r'hello of the rig: nodes must be .*; got \(\)'),
        ({'name': 7}, 'hello of the rig: name must be a text; got 7'),
        ({'numbers': '<c16'}, "hello of the rig: numbers must be one of <f4, <f8; got '<c16'"),
        ({'zero': [0.0]}, r'zero must be a list of 2; got \[0.0\]'),
        ({'zero': 0.0}, r'zero must be a list; got 0.0'),
        ({'can': ['strain', 'left']}, 'can in the hello of the rig .*; it lacks right'),
        ({'can': 'everything'}, "hello of the rig: can must be a list; got 'everything'"),
        ({'buffer': 250}, 'lead in device.address must be at most'),
    ],
)
def test_invalid_hello_is_rejected(said, why):
    rig = emulated()

    def says(frame):
        if isinstance(said, bytes):
            return encode_frame(frame.kind, frame.number, said)
        values = dataclasses.asdict(rig._hello) | said
        return encode_frame(frame.kind, frame.number, json.dumps(values).encode())

    line = TamperedLine(rig, outward=says)
    with pytest.raises((DriverError, ValueError), match=why):
        driven(line)
    assert line.closed


def test_set_points_out_of_order_are_rejected():
    line = TamperedLine(emulated())
    element = driven(line)
    element.driver._sent += 40
    with pytest.raises(
        DriverError, match='has stopped: the next set-points must be those of 200; got 240'
    ):
        live(element)


class Broken(Driver):
    """A user's driver."""

    def __init__(self, breaks):
        self._simulation = Simulation.of(CASE_II, Settings().time)
        self.dt, self.nodes = self._simulation.dt, self._simulation.nodes
        self._breaks, self.end = breaks, self._simulation.end

    def advance(self, *given):
        return self._breaks(self._simulation.advance(*given))

    def end(self, site):
        """Return what a simulation does."""


def unplugged(ends):
    raise OSError('no such device')


@pytest.mark.parametrize(
    ('breaks', 'why'),
    [
        (lambda ends: ends[:, :-1], r'must return 40 samples of both ends; got shape \(2, 39\)'),
        (lambda ends: ends[0], r'must return 40 samples of both ends; got shape \(40,\)'),
        (lambda ends: ends * np.nan, 'displacements of at most 1e6 cells; got more, or NaN'),
        (lambda ends: ends * np.inf, 'displacements of at most 1e6 cells; got more, or NaN'),
        (unplugged, 'the driver failed: no such device'),
    ],
)
def test_samples_of_any_driver_are_checked(breaks, why):
    element = MemoryElement(CASE_II, Settings(), calibration(), Broken(breaks))
    element.apply(Read())
    with pytest.raises(DriverError, match=why):
        element.advance()
    assert element.reading is None
