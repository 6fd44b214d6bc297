# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of every package may ask for."""

import os

import pytest

# Before numpy is loaded: our matrices are small, and threads of BLAS that wait for each other take
# the cores from the other workers of the suite.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')


@pytest.fixture(scope='module')
def quick_disk():
    """Let nobody wait for the disk: what a sync is worth is for `lives` to say."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, 'fsync', lambda descriptor: None)
        yield
