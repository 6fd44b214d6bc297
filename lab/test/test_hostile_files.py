# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every kind of file that a user can name, spoiled in every way: refused at once, in one line.

A kind of file is a row of `KINDS`.
"""

import argparse
import math
import os
import random
import re
import shutil
import signal
import socket
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml

from mlmem import (
    Calibration,
    DelayTable,
    MemoryElement,
    Settings,
    element_file,
    law_file,
    snapshot,
)
from mlmem.element_file import Element, ElementFileError
from mlmem.instrument.end import End, Shot
from mlmem.parsing import MAX_MESSAGE_CHARS, DecodeError
from mlmem.physics import CASE_II, Specimen, StateError
from mlmem_lab.fit import csv_shots
from mlmem_lab.standard_problems.verdict import read_others
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.host import state_file
from mlmem_ros.session import data
from mlmem_tools.cli import request
from mlmem_tools.law.curves import average_runs, load_run, save_law
from mlmem_tools.view import session_frame

ROOT = Path(__file__).parents[2]
CURVE = ROOT / 'examples/law/shell_run1.csv'
SESSION = ROOT / 'test/data/aborted_write'

PARAMETERS = """\
/**:
  ros__parameters:
    design: {preset: case_2, N: 225, eta: 0.02}
    write: {attempts: 4}
    probe: {A: 0.01}
    scale: {time: 1.0e-5}
"""

SCRIPT = """\
- {tick: 5, unit: sensor, failure: delayed, instance: 1, severity: 25}
- {tick: 500, unit: sensor, failure: ok}
"""


# --- the kinds of files -----------------------------------------------------------------------


class FileKind(NamedTuple):
    """A kind of file.

    Attributes:
        module: What reads it.
        load: Reads it, or raises one of `errors`.
        make: Writes a good one.
    """

    module: str
    load: Callable[[Path], Any]
    make: Callable[[Path], Any]
    suffix: str = '.yaml'
    errors: tuple[type[Exception], ...] = (DecodeError,)


def element():
    table = DelayTable(tuple(float(level) for level in range(CASE_II.levels)))
    return MemoryElement(CASE_II, Settings(), Calibration(table, table))


def restored(path):
    """Restore an element from a state file; none is a fresh start, which is no error."""
    if (found := state_file.load_snapshot(path)) is None:
        raise StateError('there is none')
    snapshot.restore_snapshot(element(), found)


def calibrated(path):
    if state_file.load_calibration(path, 'key', CASE_II.levels) is None:
        raise StateError('there is none')


def whole(path):
    """Read the session, and raise what was lost of it: what can be read is read."""
    found = data.load_session(path)
    if found.lost:
        raise BagError(found.lost[0])


def described(path):
    """Read a bag by its metadata, which it can do without."""
    if losses := BagReader(path.parent).losses:
        raise BagError(str(losses[0]))
    if not os.path.lexists(path):
        raise BagError('there is none')


def copied(source):
    return lambda path: shutil.copy(source, path)


def beside_its_bag(path):
    for each in SESSION.iterdir():
        shutil.copy(each, path if each.suffix == '.yaml' else path.with_name(each.name))


def varied():
    return Element(Specimen(CASE_II, mass=np.linspace(1.0, 2.0, 225)), np.full(225, 0.01))


def shot():
    samples = np.random.default_rng(1).normal(size=(2, 50))
    return Shot(End.LEFT, 1.7, 0.01, 30.0, 0, 0.0, 0.5, np.zeros(2), samples)


def answers(path):
    ours = (ROOT / 'lab/mlmem_lab/standard_problems/answers.csv').read_text().splitlines()
    path.write_text('\n'.join(line.rpartition(',')[0] for line in ours))


PART = next(SESSION.glob('*.mcap'))
OF_STATE, OF_BAG = (StateError, DecodeError), (BagError,)
KINDS = {
    'element': FileKind(
        'mlmem.element_file',
        element_file.read_element_file,
        lambda path: element_file.write_element_file(path, varied()),
    ),
    'law': FileKind(
        'mlmem.law_file',
        law_file.read_law_file,
        lambda path: save_law(path, average_runs([load_run(CURVE)], 64)),
    ),
    'state': FileKind(
        'mlmem_ros.host.state_file',
        restored,
        lambda path: state_file.save_snapshot(path, snapshot.take_snapshot(element())),
        '.json',
        OF_STATE,
    ),
    'calibration': FileKind(
        'mlmem_ros.host.state_file',
        calibrated,
        lambda path: state_file.save_calibration(path, 'key', element().calibration),
        '.json',
        OF_STATE,
    ),
    'script': FileKind(
        'mlmem_tools.cli.request',
        lambda path: request.parse_script(str(path)),
        lambda path: path.write_text(SCRIPT),
        errors=(argparse.ArgumentTypeError,),
    ),
    'curve': FileKind('mlmem_tools.law.curves', load_run, copied(CURVE), '.csv'),
    'shot': FileKind(
        'mlmem_lab.fit.csv_shots',
        csv_shots.load_shot,
        lambda path: csv_shots.save_shot(path, shot()),
        '.csv',
    ),
    'answers': FileKind('mlmem_lab.standard_problems.verdict', read_others, answers, '.csv'),
    'session': FileKind('mlmem_ros.bag.mcap_part', whole, copied(PART), '.mcap', OF_BAG),
    'session on the page': FileKind(
        'mlmem_ros.bag.mcap_part', session_frame.load_frame, copied(PART), '.mcap', OF_BAG
    ),
    'metadata': FileKind('mlmem_ros.bag.contents', described, beside_its_bag, errors=OF_BAG),
}

# --- spoiled ----------------------------------------------------------------------------------

BOMB = 'a0: &a0 [x]\n' + ''.join(
    f'a{n}: &a{n} [{", ".join([f"*a{n - 1}"] * 10)}]\n' for n in range(1, 9)
)


def no_file(path, way):
    """Lay what is no file at a path, or return another path."""
    match way:
        case 'device':
            path.symlink_to('/dev/zero')
        case 'pipe':
            os.mkfifo(path)
        case 'socket':
            with socket.socket(socket.AF_UNIX) as line:
                line.bind(str(path))
        case 'folder':
            path.mkdir()
        case 'unreadable':  # a regular file whose read fails, for root too
            path.symlink_to('/proc/self/mem')
        case 'loop':
            path.symlink_to(path)
        case 'NUL':
            return path.with_name(f'a\0{path.name}')
        case 'too long a name':
            return path.with_name('x' * 300 + path.suffix)
        case 'too long a path':
            return Path('/x' * 5000 + path.suffix)
        case 'huge':
            with path.open('wb') as file:
                file.truncate(50 * 10**9)
    return path


def cleared(path):
    if path.is_dir():
        path.rmdir()
    path.unlink(missing_ok=True)


WAYS = ('absent', 'device', 'pipe', 'socket', 'folder', 'unreadable', 'loop', 'NUL',
        'too long a name', 'too long a path', 'huge')  # fmt: skip


@pytest.fixture
def at_once():
    """Fail after ten seconds of waiting, which a pipe without a writer would take for ever."""

    def interrupt(*_):
        pytest.fail('it waits')  # no error that a command would catch

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 10.0)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


def refusal(kind, path, most=5.0):
    """Return the message with which a file is refused, or None; any other error is one."""
    start = time.process_time()
    try:
        kind.load(path)
    except kind.errors as error:
        told = str(error)
        assert len(told) <= MAX_MESSAGE_CHARS
        assert told.isprintable()
        return told
    finally:
        assert time.process_time() - start < most  # seconds; a bomb took 25
    return None


@cache
def good(name, folder):
    """Return the content of a good file of a kind."""
    path = folder / f'{name}{KINDS[name].suffix}'
    KINDS[name].make(path)
    return path.read_bytes()


@pytest.fixture(params=KINDS)
def name(request):
    return request.param


@pytest.fixture
def kind(name):
    return KINDS[name]


@pytest.fixture
def content(name, tmp_path_factory):
    return good(name, tmp_path_factory.getbasetemp())


@pytest.fixture
def path(kind, tmp_path):
    """Return where a file goes: beside the rest of its bag, if it is a part of one."""
    path = tmp_path / f'metadata{kind.suffix}'
    if kind is KINDS['metadata']:
        kind.make(path)
        path.unlink()
    return path


def test_a_good_file_is_read(kind, path, content):
    path.write_bytes(content)
    assert refusal(kind, path) is None


def test_what_is_no_file_is_refused(kind, path, at_once):
    for way in WAYS:
        assert refusal(kind, no_file(path, way)), way
        cleared(path)


WHOLE = {
    'empty': lambda content: b'',
    'garbage': lambda content: random.Random(1).randbytes(10**5),
    'UTF-16': lambda content: content.decode(errors='replace').encode('utf-16'),
    'Latin-1': lambda content: content[:20] + b'\xe4' + content[20:],
    'bomb': lambda content: BOMB.encode(),
    'deep lists': lambda content: b'[' * 10**6,
    'deep objects': lambda content: b'{"a": ' * 10**5,
    'deep rows': lambda content: b'- ' * 10**5,
    'a long line': lambda content: b'x' * 10**7,
    'an alias of itself': lambda content: b'a: &a [*a]',
    'a tag': lambda content: b'!!python/object/apply:os.system [ls]',
}


def test_a_file_of_something_else_is_refused(kind, path, content):
    for how, made in WHOLE.items():
        path.write_bytes(made(content))
        assert refusal(kind, path), how


def test_a_cut_file_is_refused_or_shorter(kind, path, content):
    """A table that ends early is a shorter table, and so may a list of YAML be."""
    for part in (0.1, 0.5, 0.9, 0.99):
        path.write_bytes(content[: int(part * len(content))])
        told = refusal(kind, path)
        assert told or kind.suffix != '.json'


COLUMNS = {'curve': (0, 1), 'answers': (2,)}
"""What is read of a table."""

NUMBER = re.compile(r'(?<=[ ,:\[\n])-?\d+\.?\d*(?:[eE][-+]?\d+)?(?=[,\]}\n])')
INFINITE = ('.inf', '.nan', 'nan', 'inf', 'Infinity', 'NaN', '1e400', '9' * 400, '9' * 5000)
ODD = ('1e308', '-1e308', '-1', '', 'x', '[1]', 'null', '1;2', '\0', '"', 'x' * 10**5)


def test_a_spoiled_number_is_refused_or_harmless(name, kind, path, content):
    """Of the numbers in a file six are drawn, each spoiled in a third of the ways by turns; what
    is not finite is refused everywhere.
    """
    if kind.suffix == '.mcap':
        return  # test/bag damages these
    text = content.decode()
    found = [
        (each.span(), text[: each.start()].rpartition('\n')[2]) for each in NUMBER.finditer(text)
    ]
    places = [
        place for place, before in found
        if name not in COLUMNS or (before[:1] != '#' and before.count(',') in COLUMNS[name])
    ]  # fmt: skip
    for turn, (start, end) in enumerate(random.Random(1).sample(places, min(6, len(places)))):
        for value in (*INFINITE, *ODD)[turn % 3 :: 3]:
            path.write_text(text[:start] + value + text[end:])
            told = refusal(kind, path)
            missing = value == 'nan' and kind is KINDS['shot']
            assert told or value in ODD or missing, (text[start - 20 : end], value[:9])


@pytest.mark.parametrize(
    ('key', 'value', 'words'),
    [('alpha_std', math.nan, 'alpha_std must be'), ('alpha_std', -1e-3, 'from 0 to 1e'),
     ('alpha', 1e308, 'alpha must be from 1/100 to 100'), ('alpha', math.inf, 'alpha must be'),
     ('mass', 0.0, 'mass'), ('offset', 10**400, 'offset')],
)  # fmt: skip
def test_an_element_that_no_cell_can_be_is_refused(tmp_path, key, value, words):
    values = varied().as_dict()
    numbers = list(values.get(key, [1.0] * CASE_II.N))
    numbers[5] = value
    path = tmp_path / 'element.yaml'
    path.write_text(yaml.safe_dump(values | {key: numbers}))
    with pytest.raises(ElementFileError, match=words):
        element_file.read_element_file(path)
