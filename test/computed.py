# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What takes long and several test files need: computed once a run, by whichever worker."""

import fcntl
import os
import pickle
from contextlib import contextmanager


@contextmanager
def alone(factory, name):
    """Keep other workers out of a block of this name; yield its file.

    Args:
        factory: The fixture `tmp_path_factory`.
        name: Of the file.
    """
    folder = factory.getbasetemp()
    if 'PYTEST_XDIST_WORKER' in os.environ:
        folder = folder.parent
    with (folder / f'{name}.pickle').open('ab+') as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield file


def once(factory, name, compute):
    """Return what `compute` returns, or has returned in another worker; it is pickled."""
    with alone(factory, name) as file:
        file.seek(0)
        if not file.read(1):
            pickle.dump(compute(), file)
            file.flush()
        file.seek(0)
        return pickle.load(file)
