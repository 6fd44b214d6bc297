# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A broken rig or driver: each fault ends in an error that names it, never in a level. A rig
answers a frame that it cannot serve with one FAULT, and serves the next client.

What is put right on the way (frames lost, damaged, repeated, out of order) is in test_rig.py.
"""

import dataclasses
import json
import math
import socket
import struct

import numpy as np
import pytest
from lines import LocalDriver, TamperedLine, driven, emulated, encode, raising, serving

from mlmem import DriverError, MemoryElement, Read, Settings
from mlmem.physics import CASE_II
from mlmem_ros.rig.frames import FrameKind, Hello, Layout, Parser, encode_frame, encode_set_points
from mlmem_tools.rig.emulated import EmulatedRig

# A frame that cannot be served must not end the rig with a traceback.
pytestmark = pytest.mark.filterwarnings('error::pytest.PytestUnhandledThreadExceptionWarning')


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
        ({'nodes': [k / 17 for k in range(1, 18)]}, 'nodes must be at most 16'),
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


HELLO = encode_frame(FrameKind.HELLO, 0, json.dumps({'protocol': 1, 'ahead': 0.0}).encode())
NONE = np.empty((2, 0))


def set_points(displacement=0.0, *, first=0, samples=80, site=0, motion=NONE, more=b''):
    """Return a hello, and a PLAY of one tick of `mlmem rig`."""
    V_N = np.full(400, displacement)
    return HELLO + encode_frame(
        FrameKind.PLAY, 1, encode_set_points(first, samples, V_N, site, motion, '<f8') + more
    )


def hello(payload):
    return encode_frame(FrameKind.HELLO, 0, payload)


BAD_FRAMES = {
    'hello_text': (hello(b'hi'), 'JSON'),
    'hello_encoding': (hello(b'\xff\xfe{'), 'JSON'),
    'hello_list': (hello(b'[1]'), 'object'),
    'hello_without_lead': (hello(b'{}'), 'ahead'),
    'hello_lead_text': (hello(b'{"ahead": "x"}'), 'ahead'),
    'hello_lead_null': (hello(b'{"ahead": null}'), 'ahead'),
    'play_head': (HELLO + encode_frame(FrameKind.PLAY, 1, b'abc'), 'got 3'),
    'play_odd_bytes': (set_points(more=b'xyz'), '3220 bytes; got 3223'),
    'play_samples': (set_points(samples=160), '6420 bytes; got 3220'),
    'play_first': (set_points(first=80), 'got 80'),
    'play_nan': (set_points(np.nan), 'V_N'),
    'play_100_cells': (set_points(100.0), 'a cell left the range'),
    'play_1e300_cells': (set_points(1e300), 'stopped being finite'),
    'held_site': (set_points(site=7, motion=np.zeros((2, 400))), 'site'),
    'held_too_long': (set_points(site=1, motion=np.zeros((2, 800))), 'at most 400'),
    'held_nan': (set_points(site=1, motion=np.full((2, 400), np.nan)), 'motion'),
    'held_100_cells': (set_points(site=1, motion=np.full((2, 400), 100.0)), 'a cell left'),
}
"""Frames that cannot be served, and a word of the fault."""


@pytest.fixture(scope='module')
def port():
    """The TCP port of a rig."""
    with serving(EmulatedRig(CASE_II, Settings())) as server:
        yield server.port


def receive(port, data, kind):
    """Send bytes to a rig; return the payload of the first frame of a kind in its answer."""
    parser = Parser()
    with socket.create_connection(('127.0.0.1', port), timeout=30.0) as connection:
        connection.sendall(data)
        while answer := connection.recv(1 << 16):
            for frame in parser.feed(answer):
                if frame.kind == kind:
                    return frame.payload
    raise AssertionError('the rig has closed the connection')


@pytest.mark.parametrize('name', BAD_FRAMES)
def test_rig_bad_frame_sends_one_fault(port, name):
    data, words = BAD_FRAMES[name]
    assert words in receive(port, data, FrameKind.FAULT).decode()
    assert Hello.of(receive(port, HELLO, FrameKind.HELLO)).name == 'emulated'


def test_rig_element_that_fails_when_idle_sends_one_fault():
    """It is strained so hard that it diverges only after the set-points have been played."""
    rig, sent = emulated(), []
    rig._at_once = False
    rig.begin(sent.append)
    V_N = np.full(200, 30.0)
    rig.take(
        HELLO + encode_frame(FrameKind.PLAY, 1, encode_set_points(0, 40, V_N, 0, NONE, '<f8'))
    )
    for _ in range(5):
        rig.pass_time(400 * rig.tick_seconds)
    (fault,) = [frame for frame in Parser().feed(b''.join(sent)) if frame.kind == FrameKind.FAULT]
    assert b'strained or shaken too hard' in fault.payload
    rig.begin(sent.append)
    rig.take(HELLO)
    assert Parser().feed(sent[-1])[0].kind == FrameKind.HELLO


def test_rig_that_ran_dry_fills_its_lead_again():
    """The next set-points would come too late again otherwise."""
    rig, played = EmulatedRig(CASE_II, Settings()), []
    rig.begin(lambda data: None)
    rig.take(hello(json.dumps({'protocol': 1, 'ahead': 3.0 * rig.tick_seconds}).encode()))
    sent = 0
    for arriving, passing in ((3, 3), (0, 2), (1, 1), (2, 1)):  # ticks
        for _ in range(arriving):
            points = encode_set_points(40 * sent, 40, np.zeros(200), 0, NONE, '<f8')
            sent += 1
            rig.take(encode_frame(FrameKind.PLAY, sent, points))
        rig.pass_time(passing * rig.tick_seconds)
        played.append(rig._played // 40)
    assert played == [3, 3, 3, 4]


def test_frames_are_found_among_noise():
    """In pieces of any size."""
    frames = [
        (FrameKind.PLAY, 7, b'mRmR'),
        (FrameKind.AGAIN, 2**40, b''),
        (FrameKind.FAULT, 9, b'm' * 300),
    ]
    noise = (b'', b'm', b'mR', b'mR\x02' + bytes(14), b'\xff' * 40, encode_frame(*frames[0])[:-1])
    stream = b''.join(each + encode_frame(*frame) for each in noise for frame in frames)
    for cut in (1, 7, len(stream)):
        parser, found = Parser(), []
        for begin in range(0, len(stream), cut):
            found += parser.feed(stream[begin : begin + cut])
        assert found == frames * len(noise)
        assert parser.skipped == 3 * sum(map(len, noise))
