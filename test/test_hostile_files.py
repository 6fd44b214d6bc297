# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every kind of file that a user can name, spoiled in every way: rejected at once, in one line.

A kind of file is a row of `KINDS`.
"""

import os
import random
import shutil
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import rig
from shot_file import save_shot

from mlmem import element_file, law_file, snapshot
from mlmem.element_file import Element
from mlmem.instrument.end import End, Shot
from mlmem.parsing import DecodeError
from mlmem.physics import CASE_II, Specimen, StateError
from mlmem.schema import MAX_MESSAGE_CHARS
from mlmem_ros.bag.errors import BagError
from mlmem_ros.host import store
from mlmem_ros.session import data
from mlmem_tools.identification import csv_shots
from mlmem_tools.law.curves import average_runs, load_run

ROOT = Path(__file__).parents[1]
CURVE = ROOT / 'examples/law/shell_run1.csv'
RECORDING = next((ROOT / 'test/data/aborted_write').glob('*.mcap'))


class Kind(NamedTuple):
    """A kind of file.

    Attributes:
        load: Reads it, or raises one of `errors`.
        make: Writes a good one.
    """

    load: Callable[[Path], Any]
    make: Callable[[Path], Any]
    suffix: str = '.yaml'
    errors: tuple[type[Exception], ...] = (DecodeError,)


def load_state(path):
    """Restore an element from a state file; none is a fresh start, which is no error."""
    if (found := store.load_snapshot(path)) is None:
        raise StateError(reason='there is none')
    snapshot.restore_snapshot(rig.device(), found)


def load_recording(path):
    """Read a session; raise what was lost of it, because what can be read is read."""
    if lost := data.load_session(path).lost:
        raise BagError(lost[0])


def save_element(path):
    varied = Specimen(CASE_II, mass=np.linspace(1.0, 2.0, 225))
    element_file.write_element_file(path, Element(varied, np.full(225, 0.01)))


def save_noise_shot(path):
    samples = np.random.default_rng(1).normal(size=(2, 50))
    shot = Shot(End.LEFT, 1.7, 0.01, 30.0, 0, 0.0, 0.5, np.zeros(2), samples)
    save_shot(path, shot)


KINDS = {
    'element': Kind(element_file.read_element_file, save_element),
    'law': Kind(
        law_file.read_law_file,
        lambda path: law_file.write_law_file(path, average_runs([load_run(CURVE)], 64).curve),
    ),
    'state': Kind(
        load_state,
        lambda path: store.save_snapshot(path, snapshot.take_snapshot(rig.device())),
        '.json',
        (StateError, DecodeError),
    ),
    'curve': Kind(load_run, lambda path: shutil.copy(CURVE, path), '.csv'),
    'shot': Kind(csv_shots.load_shot, save_noise_shot, '.csv'),
    'session': Kind(
        load_recording, lambda path: shutil.copy(RECORDING, path), '.mcap', (BagError,)
    ),
}


def bind_socket(path):
    with socket.socket(socket.AF_UNIX) as line:
        line.bind(str(path))


def make_huge(path):
    with path.open('wb') as file:
        file.truncate(50 * 10**9)


NO_FILES = {
    'absent': lambda path: None,
    'device': lambda path: path.symlink_to('/dev/zero'),
    'pipe': os.mkfifo,
    'socket': bind_socket,
    'folder': Path.mkdir,
    'unreadable': lambda path: path.symlink_to('/proc/self/mem'),  # fails for root too
    'loop': lambda path: path.symlink_to(path),
    'huge': make_huge,
}

BOMB = 'a0: &a0 [x]\n' + ''.join(
    f'a{n}: &a{n} [{", ".join([f"*a{n - 1}"] * 10)}]\n' for n in range(1, 9)
)
OTHER_CONTENTS = {
    'empty': lambda content: b'',
    'garbage': lambda content: random.Random(1).randbytes(10**5),
    'UTF-16': lambda content: content.decode(errors='replace').encode('utf-16'),
    'Latin-1': lambda content: content[:20] + b'\xe4' + content[20:],
    'bomb': lambda content: BOMB.encode(),
    'deep lists': lambda content: b'[' * 10**6,
    'deep objects': lambda content: b'{"a": ' * 10**5,
    'deep rows': lambda content: b'- ' * 10**5,
    'long line': lambda content: b'x' * 10**7,
    'alias of itself': lambda content: b'a: &a [*a]',
    'tag': lambda content: b'!!python/object/apply:os.system [ls]',
}


def rejection(kind, path):
    """Return the message with which a file is rejected, or None; any other error is raised."""
    start = time.process_time()
    try:
        kind.load(path)
    except kind.errors as error:
        message = str(error)
        assert len(message) <= MAX_MESSAGE_CHARS
        assert message.isprintable()
        return message
    finally:
        assert time.process_time() - start < 5.0  # seconds; a bomb took 25
    return None


@pytest.fixture(params=KINDS)
def kind(request):
    return KINDS[request.param]


@pytest.fixture
def path(kind, tmp_path):
    return tmp_path / f'file{kind.suffix}'


@pytest.mark.timeout(10, method='signal')
def test_path_that_is_no_file_is_rejected(kind, path):
    """At once: a pipe without a writer would be waited for, for ever."""
    for what, make in NO_FILES.items():
        make(path)
        assert rejection(kind, path), what
        if path.is_dir():
            path.rmdir()
        path.unlink(missing_ok=True)
    for wrong in (
        path.with_name(f'a\0{path.name}'),
        path.with_name('x' * 300 + path.suffix),
        Path('/x' * 5000 + path.suffix),
    ):
        assert rejection(kind, wrong), str(wrong)[:20]


def test_file_of_other_content_is_rejected(kind, path):
    """A file that is cut may be a shorter table, or a shorter list of YAML."""
    kind.make(path)
    assert rejection(kind, path) is None
    content = path.read_bytes()
    for what, spoil in OTHER_CONTENTS.items():
        path.write_bytes(spoil(content))
        assert rejection(kind, path), what
    for part in (0.1, 0.5, 0.9, 0.99):
        path.write_bytes(content[: int(part * len(content))])
        assert rejection(kind, path) or kind.suffix != '.json'
