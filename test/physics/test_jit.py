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

from mlmem_ros.physics import CASE_II, INTEGRATORS, Chain, jit

INTEGRATOR = pytest.mark.parametrize('integrator', INTEGRATORS.values(), ids=INTEGRATORS)


@INTEGRATOR
def test_the_loops_release_the_gil_and_keep_ieee_arithmetic(integrator):
    for loop in (integrator.rigid, integrator.elastic):
        assert loop.targetoptions['nogil'] is True
        assert not loop.targetoptions.get('fastmath', False)


@INTEGRATOR
@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
def test_the_loops_are_vectorised(integrator, substrate):
    """Cell by cell they would be ten times slower, as LLVM 14 leaves them without our setting."""
    Chain(dataclasses.replace(CASE_II, substrate=substrate), integrator=integrator).rest(1)
    loop = getattr(integrator, substrate)
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


def test_a_loop_built_on_another_file_is_compiled_anew_when_that_has_changed(
    tmp_path, monkeypatch
):
    """numba alone would go on with what it had inlined before."""
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path / 'cache'))
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path / 'cache'))
    formula, loop = tmp_path / 'formula.py', tmp_path / 'loop.py'
    loop.write_text('def evaluate(x):\n    return multiply(x)\n')

    def evaluate(x, factor):
        formula.write_text(f'def multiply(x):\n    return {factor} * x\n')
        inner, outer = load(formula), load(loop)
        outer.multiply = jit.inlined(inner.multiply)
        return jit.built_on(inner)(jit.kernel(outer.evaluate))(x)

    def load(source):
        spec = importlib.util.spec_from_file_location(source.stem, source)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    assert evaluate(1.0, 2.0) == 2.0
    os.utime(loop, (0.0, 0.0))  # the loop itself is as old as ever
    kept = jit._kept(jit.kernel(load(loop).evaluate))
    assert kept
    for index in kept:
        os.utime(index, (1.0, 1.0))
    assert evaluate(1.0, 3.25) == 3.25  # of another length: .pyc files go by seconds and size
