# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What takes long and several test files need: computed once a run, by whichever worker."""

import fcntl
import os
import pickle


def once(factory, name, compute):
    """Return what `compute` returns, or has returned in another worker; it is pickled.

    Args:
        factory: The fixture `tmp_path_factory`.
        name: Of its file.
        compute: Takes nothing.
    """
    folder = factory.getbasetemp()
    if 'PYTEST_XDIST_WORKER' in os.environ:
        folder = folder.parent
    with (folder / f'{name}.pickle').open('ab+') as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        if file.seek(0, os.SEEK_END) == 0:  # it may have been written since it was opened
            pickle.dump(compute(), file)
            file.flush()
        file.seek(0)
        return pickle.load(file)
