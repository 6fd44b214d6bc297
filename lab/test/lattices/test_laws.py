# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every law of the laboratory, found by itself, against finite differences.

A new law needs an example here, and nothing else.
"""

import importlib
import pkgutil

import numpy as np
import pytest

from mlmem.physics.formulas import coupling_pull, on_site_factors
from mlmem.physics.jit import compile_kernel
from mlmem_lab import lattices
from mlmem_lab.lattices import (
    Coupling,
    Linear,
    OnSite,
    Phi4,
    PowerLaw,
    Toda,
)

N = 6
EXAMPLES = [
    Phi4(0.3, 0.02),
    Linear(),
    Toda(0.8, 0.7),
    PowerLaw(17.5, -3.27, 6.0),
]
ALL = pytest.mark.parametrize('law', EXAMPLES, ids=lambda law: type(law).__name__)


def kinds():
    """Return every law that is a class in a file of the package."""
    found = set()
    for module in pkgutil.iter_modules(lattices.__path__):
        members = vars(importlib.import_module(f'{lattices.__name__}.{module.name}')).values()
        found |= {
            each
            for each in members
            if isinstance(each, type) and issubclass(each, OnSite | Coupling)
        }
    return found - {OnSite, Coupling}


def test_every_law_has_an_example():
    assert {type(each) for each in EXAMPLES} == kinds()


@ALL
def test_forces_are_derivatives(law):
    """By central differences of 1e-5: truncation and rounding leave some 1e-10 of the scale."""
    x, h = np.linspace(-1.7, 1.7, 103)[:, None] * np.ones(N), 1e-5
    slope = (law.energy(x + h) - law.energy(x - h)) / (2 * h)
    assert law.slope(x) == pytest.approx(slope, abs=1e-8, rel=1e-8)


@compile_kernel
def on_sites(constants, y, found):
    for j in range(len(y)):
        force, factor = on_site_factors(constants, j, y[j])
        found[j] = force * factor


@compile_kernel
def couplings(constants, x, found):
    for j in range(1, len(x) - 1):
        found[j] = coupling_pull(constants, j, x[j - 1], x[j], x[j + 1])


@ALL
def test_the_loops_formula_is_the_same_force(law):
    x, found = np.linspace(-1.5, 1.6, N), np.zeros(N)
    if isinstance(law, OnSite):
        on_sites(law.constants(N), x - law.origin, found)
        assert found == pytest.approx(law.slope(x), abs=1e-13)
        return
    couplings(law.constants(), x, found)
    assert found[1:-1] == pytest.approx(np.diff(law.slope(np.diff(x))), abs=1e-13)
