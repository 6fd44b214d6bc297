# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tampered sessions are read, inspected and replayed, or refused in one line.

Whatever a file says, nothing but `BagError` comes out of the reader, and the commands end with
one of their exit statuses, within two seconds and half a gigabyte (a replay takes as long as its
ticks). A variant that fails is named by its number: `BASE.tamper(number)` makes it again.
"""

import resource
import signal
from contextlib import contextmanager
from pathlib import Path

import pytest

from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_tools.cli.main import main

from .tampering import Tampered

SESSION = Path(__file__).parent.parent / 'data' / 'aborted_write'
MESSAGES = 83  # up to the state hash of tick 1000: a write, its abort, the next write's start
MOST_TEXT = 5000
"""Most characters of a refusal on the terminal."""


@pytest.fixture(scope='module')
def base():
    """The start of a real session, which has been replayed once: everything is compiled."""
    assert main(['inspect', str(SESSION)]) == 0
    assert main(['replay', str(SESSION)]) == 0
    made = Tampered.read(SESSION)
    del made.messages[MESSAGES:]
    return made


@contextmanager
def within(seconds, megabytes=500):
    """Limit processor time and memory."""

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


def command(name, path, capsys):
    """Run a command; check its exit status and the length of its error."""
    capsys.readouterr()
    status = main([name, str(path)])
    if status not in (0, 1, 2):
        raise ValueError(f'it ended with {status}')
    if len(capsys.readouterr().err) > MOST_TEXT:
        raise ValueError('it complained at length')


WAYS = {
    'read': (2.0, lambda path, _: read(path)),
    'inspect': (2.0, lambda path, capsys: command('inspect', path, capsys)),
    # which runs what ticks the session can have
    'replay': (10.0, lambda path, capsys: command('replay', path, capsys)),
}
"""What is done with a session, and the seconds it may take."""


def fault_of(path, ways, capsys):
    """Return how handling a bag fails, or an empty text."""
    for way in ways:
        seconds, take = WAYS[way]
        try:
            with within(seconds):
                take(path, capsys)
        except Exception as error:
            return f'{way}: {type(error).__name__}: {error}'[:200]
    return ''


def faults(base, numbers, folder, capsys, together):
    """Return the failures of variants, each handled in all ways or in one of them."""
    found = []
    for number in numbers:
        made = base.tamper(number)
        path = folder / f'{number}'
        made.write(path)
        ways = WAYS if together else [list(WAYS)[number % len(WAYS)]]
        if fault := fault_of(path, ways, capsys):
            found.append(f'{made.what}: {fault}')
    return found


def test_tampered_session_is_read_or_rejected(base, tmp_path, capsys):
    assert faults(base, range(24), tmp_path, capsys, together=False) == []


@pytest.mark.slow
@pytest.mark.parametrize('thousand', range(4))
def test_thousands_of_tampered_sessions_are_read_or_rejected(base, tmp_path, capsys, thousand):
    numbers = range(1000 * thousand, 1000 * (thousand + 1))
    assert faults(base, numbers, tmp_path, capsys, together=True) == []
