# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The loop gives the bits recorded here, on every processor that runs or compiles it."""

import dataclasses
import hashlib
import os
import subprocess
import sys

import llvmlite.binding
import numpy as np
import pytest
from laws import sample_force

from mlmem.physics import CASE_II, SUBSTEPS_PER_STEP, Chain, HeldCell, Specimen

BITS = {
    'rigid': '9968d146237c39c2',
    'elastic': '2da8a24383ee8acf',
    'curve': '71d54de2819c32de',
}
"""A change here changes the bits of every session: it needs a new `ARITHMETIC_VERSION` and new
golden sessions."""

PROCESSORS = {'x86-64': '', 'haswell': 'fma', 'skylake-avx512': 'avx512f'}
"""Processors to compile for, and the feature that the host needs to run the code."""


def case(substrate):
    """Return a chain and its inputs: strain, shake, a driven end; a heavy and a stuck cell."""
    design = dataclasses.replace(CASE_II, N=67, eta=0.05)
    if substrate == 'curve':  # over a rigid one
        law = sample_force(lambda D: 4.0 * D * (D * D - 1.0), -2.0, 2.0, 41)
        design = dataclasses.replace(design, law=law, phase=0)
    else:
        design = dataclasses.replace(design, substrate=substrate)
    chain = Chain(design)
    mass, steps = np.ones(design.N), 300
    mass[9] = 5.0
    offset = 0.01 * (design.sites % 3.0 - 1.0)  # no sine of a library
    chain.set_specimen(Specimen(design, mass=mass, offset=offset, stuck=(41,)))
    t = np.arange(steps * SUBSTEPS_PER_STEP) / SUBSTEPS_PER_STEP
    shake = (t % 16.0 - 8.0) / 1024.0
    motion = np.array([design.D_s1 + (t[:200] % 32.0) / 64.0, (t[:200] % 8.0) / 64.0])
    return chain, (t / 128.0, HeldCell(1, motion), shake)


def bits(substrate):
    """Return the hash of the final state and of the ends' motion."""
    chain, inputs = case(substrate)
    ends = chain.advance(*inputs)
    return hashlib.sha256(chain.state().tobytes() + ends.tobytes()).hexdigest()[:16]


@pytest.mark.parametrize('substrate', BITS)
def test_bits_are_those_of_this_arithmetic(substrate):
    assert bits(substrate) == BITS[substrate]


@pytest.mark.slow
@pytest.mark.parametrize('name', PROCESSORS)
def test_bits_are_same_compiled_for_another_processor(name, tmp_path):
    """The first has no fused multiply-add and calls the C library."""
    features = llvmlite.binding.get_host_cpu_features()
    if (needed := PROCESSORS[name]) and not features.get(needed):
        pytest.skip(f'this processor has no {needed}')
    choice = {'NUMBA_CPU_NAME': name, 'NUMBA_CPU_FEATURES': '', 'NUMBA_CACHE_DIR': str(tmp_path)}
    told = subprocess.check_output([sys.executable, __file__], env=os.environ | choice, text=True)
    assert told.split() == list(BITS.values())


if __name__ == '__main__':
    print(*(bits(each) for each in BITS))
