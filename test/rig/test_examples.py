# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rigs in examples/rig speak docs/reference/rig.md, and share no code with us."""

import contextlib
import os
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
import tty
from pathlib import Path

import numpy as np
import pytest

from mlmem import DriverError, MemoryElement, Read, Settings, Write
from mlmem.instrument.drivers import open_driver
from mlmem.physics import CASE_II
from mlmem.settings import ReadSettings, ScaleSettings
from mlmem_ros.rig.frames import FrameKind, Parser

EXAMPLES = Path(__file__).parents[2] / 'examples' / 'rig'
SOON = 60.0

# A line that goes must not end a thread with a traceback.
pytestmark = pytest.mark.filterwarnings('error::pytest.PytestUnhandledThreadExceptionWarning')


UNIT = 2e-4
"""Seconds of a time unit."""

LEAD = f'lead={500 * UNIT}'
"""As long as the rig in C can keep set-points: half of its buffer."""


def element_at(address):
    patient = ReadSettings(attempts=100)  # a busy machine may be late with set-points
    settings = Settings(scale=ScaleSettings(time=UNIT), read=patient)
    driver = open_driver('rig', f'{address}&{LEAD}', CASE_II, settings)
    return MemoryElement(CASE_II, settings, driver=driver)


def remembers(address, level, name):
    """Assert that the element of a rig is blank, is written, and is read by the next driver.

    Returns:
        The health of the line while it was written.
    """
    element = element_at(address)
    assert element.perform(Read()).reading.level == -1
    written = element.perform(Write(level))
    assert written.success, written.error
    health = element.driver.health()
    element.driver.close()
    element = element_at(address)
    assert element.perform(Read('both')).reading.level == level
    assert element.driver.health()['rig'] == name
    element.driver.close()
    return health


# --- Python -----------------------------------------------------------------------------------


@pytest.fixture
def plain_rig():
    """Run rig.py at a free port; yield its address."""
    with socket.create_server(('127.0.0.1', 0)) as free:
        port = free.getsockname()[1]
    command = [sys.executable, '-I', EXAMPLES / 'rig.py', str(port), str(UNIT)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    try:
        end = time.monotonic() + SOON
        while time.monotonic() < end:
            with contextlib.suppress(OSError), socket.create_connection(('127.0.0.1', port)):
                break
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.02)  # it is importing numpy
        yield f'tcp://127.0.0.1:{port}?patience=10'
        assert process.poll() is None, process.stderr.read()
    finally:
        process.kill()
        process.communicate()


def test_rig_in_python_writes_and_reads(plain_rig):
    assert remembers(plain_rig, 0, 'plain')['skipped_bytes'] == 0


# --- C99 --------------------------------------------------------------------------------------


@contextlib.contextmanager
def wired(program, damage=0.0):
    """Run the program at one end of a serial line of two pseudo-terminals.

    Args:
        program: Path of a rig.
        damage: Probability that a byte arrives with a wrong bit, in either direction.

    Yields:
        The address of the other end, and a list of the frames that the rig has sent.
    """
    over, chance, frames, parser = threading.Event(), np.random.default_rng(1), [], Parser()
    (ours, port), (theirs, other) = os.openpty(), os.openpty()
    for end in (ours, port, theirs, other):
        tty.setraw(end)
    for end in (ours, theirs):
        os.set_blocking(end, False)

    def relay():
        other_end, held = {ours: theirs, theirs: ours}, {ours: b'', theirs: b''}
        while not over.is_set():
            full = [end for end in held if held[end]]
            come, free, _ = select.select(list(held), full, [], 0.05)
            for end in come:
                data = os.read(end, 1 << 12)
                if end == theirs:
                    frames.extend(parser.feed(data))
                wrong = chance.random(len(data)) < damage
                held[other_end[end]] += (np.frombuffer(data, np.uint8) ^ wrong).tobytes()
            for end in free:
                held[end] = held[end][os.write(end, held[end]) :]

    thread = threading.Thread(target=relay)
    thread.start()
    process = subprocess.Popen([program, os.ttyname(other), str(UNIT)])
    try:
        yield f'serial://{os.ttyname(port)}?baud=3000000&patience=10', frames
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()
        over.set()
        thread.join()
        for end in (ours, port, theirs, other):
            os.close(end)


@pytest.fixture(scope='module')
def program(tmp_path_factory):
    """Compile rig.c, strictly; return the path of the program."""
    if (compiler := shutil.which('cc')) is None:
        pytest.skip('there is no C compiler')
    path = tmp_path_factory.mktemp('rig') / 'rig'
    strict = ['-std=c99', '-O2', '-pedantic', '-Wall', '-Wextra', '-Wconversion', '-Werror']
    subprocess.run([compiler, *strict, '-o', path, EXAMPLES / 'rig.c', '-lm'], check=True)
    return path


def test_rig_in_c_writes_reads_and_repairs_its_line(program):
    """Both sides ask for damaged frames again."""
    with wired(program, damage=4e-5) as (address, frames):
        health = remembers(address, 0, 'C99')
    assert health['asked_again'] > 5
    assert [frame.kind for frame in frames].count(FrameKind.AGAIN) > 5


def test_rig_in_c_releases_the_strain_of_a_lost_driver(program):
    """Not of one that compiles or plans for longer than the rig's second of silence; a strain that
    nobody looks after is released, and the driver hears of it.
    """
    with wired(program) as (address, _):
        element = element_at(address)
        element.actuator.ramp_to(0.01, 100.0)
        while element.actuator.is_moving:
            element.advance()
        time.sleep(1.5)
        for _ in range(2 * element.driver.lag):  # a fault would be heard
            element.advance()
        rig, heard = element.driver.driver, b''
        with rig._turn:  # it hangs in a call
            while b'the strain is zero' not in heard:
                come = rig._transport.receive(SOON)
                assert come, 'the strain is held though nobody speaks'
                heard += come
            rig._transport._come = heard
        with pytest.raises(DriverError, match='has stopped: no byte came for a second'):
            element.perform(Read())
        element.driver.close()
