# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sessions whose content was changed: read, inspected and replayed, or refused in one line.

Whatever a file says, nothing but `BagError` comes out of the reader, and the commands end with
one of their exit statuses, within two seconds and half a gigabyte (a replay takes as long as its
ticks). A variant that fails is named by its number: `BASE.tamper(number)` makes it again.
"""

import resource
import signal
from contextlib import contextmanager
from pathlib import Path

import pytest

from mlmem_ros.bag import BagError, BagReader
from mlmem_ros.cli.main import main

from .tampering import Tampered

SESSION = Path(__file__).parent.parent / 'data' / 'aborted_write'
COMMANDS = {'inspect': 2.0, 'replay': 10.0}
"""Seconds that each may take; a replay runs what ticks the session can have."""

MOST_TEXT = 5000
"""Characters that a refusal may take on the terminal."""


@pytest.fixture(scope='module')
def base():
    """A real session, which has been read and replayed once: everything is compiled."""
    assert main(['inspect', str(SESSION)]) == 0
    assert main(['replay', str(SESSION)]) == 0
    return Tampered.read(SESSION)


@contextmanager
def within(seconds, megabytes=500):
    """Interrupt what takes longer, by the processor's clock, and refuse what takes more memory."""

    def interrupt(*_):
        raise TimeoutError(f'still busy after {seconds} s')

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    signal.signal(signal.SIGVTALRM, interrupt)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    assert grown < megabytes, f'it took {grown:.0f} MB'


def fault_of(path, commands, capsys):
    """Return what is wrong with how a bag is taken, or an empty text."""
    try:
        with within(2.0):
            read(path)
        for command in commands:
            capsys.readouterr()
            with within(COMMANDS[command]):
                status = main([command, str(path)])
            if status not in (0, 1, 2):
                return f'{command} ended with {status}'
            if len(capsys.readouterr().err) > MOST_TEXT:
                return f'{command} complained at length'
    except Exception as error:
        return f'{type(error).__name__}: {error}'[:200]
    return ''


def read(path):
    """Decode all that can be decoded."""
    try:
        reader = BagReader(path)
    except BagError:
        return
    for message in reader:
        try:
            reader.deserialize(message)
        except BagError as error:
            if len(str(error)) > MOST_TEXT:
                raise ValueError(f'an error of {len(str(error))} characters') from error


def faults(base, numbers, folder, capsys, together=2):
    """Return what is wrong with variants, each given to so many of the commands in turn."""
    found = []
    for number in numbers:
        made = base.tamper(number)
        path = folder / f'{number}'
        made.write(path)
        commands = [name for n, name in enumerate(COMMANDS) if (number + n) % 2 < together]
        if fault := fault_of(path, commands, capsys):
            found.append(f'{made.what}: {fault}')
    return found


def test_the_session_itself_is_read(base, tmp_path, capsys):
    base.write(tmp_path / 'whole')
    assert fault_of(tmp_path / 'whole', COMMANDS, capsys) == ''
    assert main(['replay', str(tmp_path / 'whole')]) == 0


def test_a_tampered_session_is_taken_or_refused(base, tmp_path, capsys):
    assert faults(base, range(200), tmp_path, capsys, together=1) == []


@pytest.mark.slow
@pytest.mark.parametrize('thousand', range(1, 4))
def test_thousands_of_tampered_sessions(base, tmp_path, capsys, thousand):
    numbers = range(1000 * thousand, 1000 * (thousand + 1))
    assert faults(base, numbers, tmp_path, capsys) == []
