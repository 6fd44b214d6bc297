# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of every package may ask for."""

import os
import sys

import pytest

# Before numpy is loaded: our matrices are small, and threads of BLAS that wait for each other take
# the cores from the other workers of the suite.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

# Nodes and commands are processes of their own, a hundred of them: without bytecode each would
# compile all of us anew, and every worker the assertions of all tests.
os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
sys.dont_write_bytecode = False


@pytest.fixture(scope='module')
def quick_disk():
    """Let nobody wait for the disk: what a sync is worth is for `lives` to say."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, 'fsync', lambda descriptor: None)
        yield
