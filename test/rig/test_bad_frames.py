# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A rig answers a frame that it cannot serve with one FAULT and serves the next client; and frames
that come too late, or among noise.
"""

import json
import socket

import numpy as np
import pytest

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem_ros.rig.frames import (
    FrameKind,
    Hello,
    Parser,
    encode_frame,
    encode_set_points,
)
from mlmem_tools.rig.emulated import EmulatedRig

from .lines import emulated, serving

HELLO = encode_frame(FrameKind.HELLO, 0, json.dumps({'protocol': 1, 'ahead': 0.0}).encode())
NONE = np.empty((2, 0))
TIMEOUT_S = 30.0

# A frame that cannot be served must not end the rig with a traceback.
pytestmark = pytest.mark.filterwarnings('error::pytest.PytestUnhandledThreadExceptionWarning')


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
    with socket.create_connection(('127.0.0.1', port), timeout=TIMEOUT_S) as connection:
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
