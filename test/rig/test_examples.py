# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rigs in examples/rig speak docs/reference/rig.md, and share no code with us."""

import ast
import contextlib
import math
import os
import random
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
import tty
from pathlib import Path

import pytest

from mlmem_ros.device import DriverError, MemoryElement, Read, Settings, Write, drivers
from mlmem_ros.device.settings import ReadSettings, ScaleSettings
from mlmem_ros.physics import CASE_II

from .lines import calibration

EXAMPLES = Path(__file__).parents[2] / 'examples' / 'rig'
SOON = 20.0


def element_at(address, unit=1e-4):
    patient = ReadSettings(attempts=10)  # a busy machine may be late with set-points
    settings = Settings(scale=ScaleSettings(time=unit), read=patient)
    driver = drivers.opened('rig', f'{address}&lead={500 * unit}', CASE_II, settings)
    return MemoryElement(CASE_II, settings, calibration(), driver)


def remembers(element, level):
    """Assert that the element of a rig is blank, and is written and read."""
    assert element.perform(Read()).reading.level == -1
    written = element.perform(Write(level))
    assert written.success, written.error
    assert element.perform(Read('both')).reading.level == level
    element.driver.close()


# --- Python -----------------------------------------------------------------------------------


@pytest.fixture
def plain_rig():
    """Run rig.py at a free port; yield its address."""
    with socket.create_server(('127.0.0.1', 0)) as free:
        port = free.getsockname()[1]
    command = [sys.executable, '-I', EXAMPLES / 'rig.py', str(port), '1e-4']
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


def test_the_rig_in_python_is_short_and_needs_nothing_of_us():
    text = (EXAMPLES / 'rig.py').read_text()
    assert text.count('\n') <= 150
    used = {
        alias.name.split('.')[0]
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    assert 'mlmem_ros' not in used
    assert used - sys.stdlib_module_names == {'numpy'}


def test_the_rig_in_python_remembers(plain_rig):
    """Also for the next driver."""
    remembers(element_at(plain_rig), 0)
    element = element_at(plain_rig)
    assert element.driver.health()['rig'] == 'plain'
    assert element.perform(Read()).reading.level == 0
    element.driver.close()


def test_the_rig_in_python_refuses_what_is_not_due(plain_rig):
    element = element_at(plain_rig)
    element.driver.driver._sent += 80
    with pytest.raises(DriverError, match='has stopped: these are not the set-points'):
        element.perform(Read())


# --- C99 --------------------------------------------------------------------------------------


@pytest.fixture(scope='module')
def program(tmp_path_factory):
    """Compile rig.c, strictly."""
    if (compiler := shutil.which('cc')) is None:
        pytest.skip('there is no C compiler')
    program = tmp_path_factory.mktemp('rig') / 'rig'
    flags = ['-std=c99', '-O2', '-pedantic', '-Wall', '-Wextra', '-Wconversion', '-Werror']
    subprocess.run([compiler, *flags, '-o', program, EXAMPLES / 'rig.c', '-lm'], check=True)
    return program


@contextlib.contextmanager
def wired(program, damage=0.0, unit=1e-4):
    """Run the program at one end of a serial line; yield the port at the other.

    The line is two pseudo-terminals; each byte on it is damaged with a probability.
    """
    chance, over = random.Random(1), threading.Event()
    (ours, port), (theirs, other) = os.openpty(), os.openpty()
    for end in (ours, port, theirs, other):
        tty.setraw(end)
    for end in (ours, theirs):
        os.set_blocking(end, False)

    def relay():
        next_damage = chance.expovariate(damage) if damage else math.inf  # in bytes
        other_end, held = {ours: theirs, theirs: ours}, {ours: b'', theirs: b''}
        while not over.is_set():
            full = [end for end in held if held[end]]
            come, free, _ = select.select(list(held), full, [], 0.05)
            for end in come:
                data = bytearray(os.read(end, 1 << 12))
                while next_damage < len(data):
                    data[int(next_damage)] ^= 1 << chance.randrange(8)
                    next_damage += 1.0 + chance.expovariate(damage)
                next_damage -= len(data)
                held[other_end[end]] += data
            for end in free:
                held[end] = held[end][os.write(end, held[end]) :]

    thread = threading.Thread(target=relay)
    thread.start()
    process = subprocess.Popen([program, os.ttyname(other), str(unit)])
    try:
        yield f'serial://{os.ttyname(port)}?baud=3000000&patience=10'
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()
        over.set()
        thread.join()
        for end in (ours, port, theirs, other):
            os.close(end)


def test_the_rig_in_c_allocates_nothing():
    text = (EXAMPLES / 'rig.c').read_text()
    for word in ('malloc', 'calloc', 'realloc', 'alloca', 'strdup'):
        assert f'{word}(' not in text


def test_the_rig_in_c_remembers(program):
    with wired(program) as address:
        remembers(element_at(address), 0)
        element = element_at(address)
        assert element.perform(Read()).reading.level == 0
        assert element.driver.health()['rig'] == 'C99'
        assert element.driver.health()['skipped_bytes'] == 0
        element.driver.close()


def test_the_rig_in_c_repairs_its_line(program):
    """Both sides ask for damaged frames again, so that no sample is missed."""
    with wired(program, damage=2e-4) as address:
        element = element_at(address)
        element.perform(Read())
        outcome = element.perform(Read())
        assert outcome.success, outcome.error
        assert outcome.reading.level == -1
        health = element.driver.health()
        assert health['skipped_bytes'] > 1000
        assert health['asked_again'] > 5
        element.driver.close()


def test_the_rig_in_c_goes_limp_when_nobody_speaks(program):
    """A strain that nobody looks after is released, and the driver hears of it."""
    with wired(program) as address:
        element = element_at(address)
        element.actuator.ramp_to(0.01, 100.0)
        while element.actuator.moving:
            element.advance()
        time.sleep(1.5)
        with pytest.raises(DriverError, match='has stopped: no byte came for a second'):
            element.perform(Read())
        element.driver.close()
