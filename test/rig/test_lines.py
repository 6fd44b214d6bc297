# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames on real lines: TCP with latency, jitter and losses to a rig with a clock, and noise."""

import pytest

from mlmem import Read, Settings
from mlmem.physics import CASE_II
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.settings import ScaleSettings
from mlmem_ros.rig.frames import FrameKind, Parser, encode_frame
from mlmem_tools.rig.emulated import LineProperties

from .lines import PatientRig, connect, serving

FAST = Settings(scale=ScaleSettings(time=1e-5))


LATE = LineProperties(latency=0.002, jitter=0.003, loss=0.003, seed=3)


def test_latency_shifts_no_echo():
    """Five milliseconds are 500 time units here; the delay is that of the calibration."""
    rig = PatientRig(CASE_II, FAST, drift=2e-4)
    with serving(rig, LATE) as server:
        rig.chain.place(find_pinned_wall(CASE_II, 2))
        element = connect(f'tcp://127.0.0.1:{server.port}?lead=0.2&patience=10', FAST)
        assert element.driver.lag == 1000
        reading = element.perform(Read()).reading
        assert reading.level == 2
        assert reading.delay == pytest.approx(element.calibration.left.delays[2], abs=1.0)
        element.driver.close()


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
