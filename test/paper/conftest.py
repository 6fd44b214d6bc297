# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The data of figures, computed once per run: small, and at full size for slow tests."""

import fcntl
import os
import pickle

import pytest

from mlmem_ros.paper.figure import Quality
from mlmem_ros.paper.gallery import BY_NAME


class Computed(dict):
    """The data of figures by name, computed when first asked for, by whichever worker."""

    def __init__(self, quality, basetemp):
        super().__init__()
        self.quality = quality
        shared = basetemp.parent if 'PYTEST_XDIST_WORKER' in os.environ else basetemp
        self.folder = shared / f'figures-{quality.value}'
        self.folder.mkdir(exist_ok=True)

    def __missing__(self, name):
        with (self.folder / f'{name}.pickle').open('ab+') as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            file.seek(0)
            if not file.read(1):
                pickle.dump(BY_NAME[name].compute(self.quality), file)
                file.flush()
            file.seek(0)
            self[name] = pickle.load(file)
        return self[name]


@pytest.fixture(scope='session')
def small(tmp_path_factory):
    return Computed(Quality.DRAFT, tmp_path_factory.getbasetemp())


@pytest.fixture(scope='session')
def full(tmp_path_factory):
    return Computed(Quality.FULL, tmp_path_factory.getbasetemp())
