# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The compiler settings: no GIL, no fast-math, and a machine where nothing can be cached."""

import dataclasses
import errno
import importlib.util
import os
import platform
import re
from pathlib import Path

import llvmlite.binding
import numba
import numpy as np
import pytest

from mlmem.physics import CASE_II, Chain, jit
from mlmem.physics.pefrl import advance
from mlmem.physics.stepping import NO_INPUTS


def test_loop_releases_gil_and_keeps_ieee_arithmetic():
    assert advance.targetoptions['nogil'] is True
    assert not advance.targetoptions.get('fastmath', False)


@pytest.mark.parametrize('substrate', ['rigid', 'elastic'])
def test_loop_is_vectorised(substrate):
    """Cell by cell they would be ten times slower: LLVM 14 leaves them so without our setting.

    Seen in the code that runs, be it from the cache: which was made by these settings.
    """
    features = numba.config.CPU_FEATURES  # NUMBA_CPU_FEATURES, if set, decides
    if features is None:
        features = llvmlite.binding.get_host_cpu_features().flatten()
    if platform.machine() in ('x86_64', 'AMD64') and '+fma' not in features.split(','):
        pytest.skip('every fma is a call')
    chain = Chain(dataclasses.replace(CASE_II, substrate=substrate))
    chain.advance_steps(1)
    nothing = chain._build_arguments(NO_INPUTS, np.empty((2, 0)))
    compiled = advance.overloads[tuple(map(numba.typeof, nothing))]
    packed = r'call .*@llvm\.fma\.v\d+f64'
    found = re.findall(packed, str(compiled.library._get_module_for_linking()))
    assert len(found) > 20  # one pass over the cells has as many


def test_loops_without_a_place_for_a_cache_still_compile(monkeypatch):
    def no_place_to_write(function):
        raise RuntimeError('cannot cache function: no locator available for file')

    monkeypatch.setattr(jit, '_Cache', no_place_to_write)
    double = jit.compile_kernel(lambda x: 2.0 * x)
    assert double(2.5) == 5.0


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Return a function that freshly loads a compiled loop `evaluate` built on `multiply`; the
    cache is empty.
    """
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path / 'cache'))

    def load_module(name, text):
        source = tmp_path / f'{name}.py'
        if not source.exists() or source.read_text() != text:
            source.write_text(text)
        spec = importlib.util.spec_from_file_location(name, source)
        loaded = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(loaded)
        return loaded

    def load_loop(factor):
        formula = load_module('formula', f'def multiply(x):\n    return {factor} * x\n')
        outer = load_module('loop', 'def evaluate(x):\n    return multiply(x)\n')
        outer.multiply = jit.inline_function(formula.multiply)
        return jit.compile_kernel(outer.evaluate)

    return load_loop


def test_cached_loop_is_recognised_by_its_argument_types(load):
    """It is not compiled then."""
    first = load(2.0)
    assert not jit.is_cached(first, 1.0)
    assert first(1.0) == 2.0
    assert jit.is_cached(first, 1.0)
    again = load(2.0)
    assert jit.is_cached(again, 3.0)
    assert not jit.is_cached(again, np.ones(3))
    assert not again.overloads


def test_loop_is_recompiled_when_file_it_inlines_changes(load):
    """numba alone would keep using the old inlined code."""
    assert load(2.0)(1.0) == 2.0
    changed = load(3.25)  # of another length: .pyc files go by seconds and size
    assert not jit.is_cached(changed, 1.0)
    assert changed(1.0) == 3.25


@pytest.mark.parametrize(('kind', 'share'), [('nbi', 0.0), ('nbc', 0.5)])
def test_torn_cache_is_compiled_anew_and_reported_once(load, kind, share, caplog):
    """A power cut leaves an empty or a half file, be it of the index or of the data; numba alone
    fails at every start.
    """
    index = Path(load(2.0)._cache._cache_file._index_path)
    assert load(2.0)(1.0) == 2.0
    (file,) = index.parent.glob(f'*.{kind}')
    whole = file.read_bytes()
    file.write_bytes(whole[: int(share * len(whole))])
    torn = load(2.0)
    assert not jit.is_cached(torn, 1.0)
    assert torn(1.0) == 2.0
    assert [line for line in caplog.messages if 'its cache cannot be loaded' in line]
    caplog.clear()
    assert jit.is_cached(load(2.0), 1.0)
    assert load(2.0)(1.0) == 2.0
    assert not caplog.messages


def test_full_disk_leaves_loops_uncached_and_warns_once(load, monkeypatch, caplog):
    def write(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, 'replace', write)
    assert [load(factor)(1.0) for factor in (2.0, 3.25)] == [2.0, 3.25]
    (line,) = caplog.messages
    assert 'No space left on device' in line
