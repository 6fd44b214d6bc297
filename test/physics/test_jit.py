# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The compiler settings: no GIL, no fast-math, and a machine where nothing can be cached."""

import dataclasses
import re

import numba
import numpy as np
import pytest

from mlmem_ros.physics import CASE_II, Chain, jit, kernel


def test_the_loops_release_the_gil_and_keep_ieee_arithmetic():
    for loop in (kernel.advance_rigid, kernel.advance_elastic):
        assert loop.targetoptions['nogil'] is True
        assert not loop.targetoptions.get('fastmath', False)


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
def test_the_loops_are_vectorised(substrate):
    """Cell by cell they would be ten times slower, as LLVM 14 leaves them without our setting."""
    Chain(dataclasses.replace(CASE_II, substrate=substrate)).rest(1)
    loop = getattr(kernel, f'advance_{substrate}')
    fresh = numba.njit(**jit.SETTINGS)(loop.py_func)
    fresh.compile(loop.signatures[0])
    code = fresh.inspect_asm(fresh.signatures[0])
    assert len(re.findall(r'\bv?mulpd', code)) > 30


def test_where_nothing_can_be_cached_it_compiles_all_the_same(monkeypatch):
    njit = numba.njit

    def no_place_to_write(**options):
        if options.get('cache'):
            raise RuntimeError('cannot cache function: no locator available for file')
        return njit(**options)

    monkeypatch.setattr(jit.numba, 'njit', no_place_to_write)

    @jit.kernel
    def total(x):
        result = 0.0
        for j in range(len(x)):
            result += x[j]
        return result

    assert total(np.arange(5.0)) == 10.0
