# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS graph for this run alone, memory nodes in it, and the order of the tests."""

from __future__ import annotations

import fcntl
import gc
import importlib.util
import os
import signal
import sys
import time
from contextlib import suppress
from itertools import groupby
from operator import itemgetter
from pathlib import Path

import pytest

# Before numpy is loaded: our matrices are small, and BLAS threads that wait for each other take
# the cores from the other workers.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

# Or Hypothesis would load what other packages add to it, in every process.
os.environ.setdefault('HYPOTHESIS_NO_PLUGINS', '1')

# Without bytecode every node and command that a test starts would compile the package again, and
# every worker the assertions of all tests.
os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
sys.dont_write_bytecode = False

pytest.register_assert_rewrite('mlmem_ros.testing')  # before anything imports it

ROOT = Path(__file__).parent
HAVE_ROS = importlib.util.find_spec('rclpy') is not None
NEED_ROS = {'ros', 'view', 'docs'}


def remove_stale_memory():
    """Remove the shared memory of killed nodes, of which Fast DDS complains on standard output.

    A living process holds the lock of the file with `_el` at its end; a new one gets it at once.
    """
    for path in Path('/dev/shm').glob('fast[dr]*'):
        lock = path.with_name(f'{path.name.removesuffix("_el")}_el')
        with suppress(OSError):  # the lock is held, or the file has gone meanwhile
            if time.time() - path.stat().st_mtime < 60.0:
                continue
            if lock.exists():
                with lock.open() as file:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()


if HAVE_ROS:
    from nodes import run_nodes

    from mlmem_ros.testing import isolate

    isolate()
    remove_stale_memory()
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:  # started with & from a script:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # children would inherit it


collect_ignore = [] if HAVE_ROS else [*NEED_ROS, 'contract', 'sessions/test_replay.py']


@pytest.hookimpl(hookwrapper=True)
def pytest_collection():
    """Spare the garbage collector what is imported, now and later."""
    gc.disable()
    yield
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(items):
    """Spread the files that wait, for nodes or a browser, evenly among those that compute."""
    files = [list(group) for _, group in groupby(items, key=lambda item: item.path)]
    rooms = [[], []]
    for file in files:
        rooms[NEED_ROS.isdisjoint(file[0].path.parts)].append(file)
    placed = [(place / len(room), file) for room in rooms for place, file in enumerate(room)]
    items[:] = [item for _, file in sorted(placed, key=itemgetter(0)) for item in file]


@pytest.fixture(scope='module')
def one_owner():
    """Fail if anything but its loop's thread touches a device that runs."""
    from owner import owned

    found = []
    with owned(found.append):
        yield
    assert not found, '\n'.join(sorted(set(found)))


@pytest.fixture(scope='session', autouse=True)
def quick_disk():
    """Skip every fsync of this process: what a sync is worth is tested in `seeded_runs`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, 'fsync', lambda descriptor: None)
        yield


@pytest.fixture(scope='module')
def driver():
    """The driver of a module's nodes."""
    return 'sim'


@pytest.fixture
def start(driver):
    """Start a node for one test: start(parameters, ...), like `memory_node`."""
    with run_nodes(driver) as start:
        yield start


@pytest.fixture(scope='module')
def start_shared(driver):
    """Start a node for all tests of a module."""
    with run_nodes(driver, shared=True) as start:
        yield start
