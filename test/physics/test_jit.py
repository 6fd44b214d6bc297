# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The compiler settings: no GIL, no fast-math, and a machine where nothing can be cached."""

import dataclasses
import importlib.util
import os
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


def test_a_loop_that_is_in_the_cache_is_known(tmp_path, monkeypatch):
    """From outside, without loading it; a change of the source makes it stale."""
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path / 'cache'))
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path / 'cache'))
    source = tmp_path / 'doubling.py'
    source.write_text('def double(x):\n    return 2.0 * x\n')

    def loaded():
        spec = importlib.util.spec_from_file_location('doubling', source)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return jit.kernel(module.double)

    first = loaded()
    assert not jit.in_cache(first)
    first(1.0)
    assert jit.in_cache(first)
    assert jit.in_cache(loaded())
    later = source.stat().st_mtime + 10.0
    os.utime(source, (later, later))
    assert not jit.in_cache(loaded())
