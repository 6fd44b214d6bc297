# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design: Table I as one value.

====================  ==============================================================
quantity              must agree with
====================  ==============================================================
alpha                 its definition, site by site; soft exactly at the defects
s                     Eq. (2) as printed; least at j_0 (mod J_s), 3 : 1
strain_shape          the balance of the bare substrate's springs (linear solve)
levels, bits, codes   the paper's count of the Case II element: 8 levels, 3 bits
a wrong design        one message: symbol, what it must be, what it is
====================  ==============================================================
"""

import math
from dataclasses import FrozenInstanceError, replace

import numpy as np
import oracle
import pytest

from mlmem import ELEMENT_NAMES, load_element
from mlmem.physics import CASE_I, CASE_II, DesignError


def test_designs_are_those_of_table_i():
    common = {'a': 0.2582, 'b': 0.0172, 'c': 7.4489}
    case_i = {'gamma': -2.5e-4, 'beta': -0.2, 'J': 100, 'J_s': 200, 'j_0': 81, 'd': 0.0061}
    case_ii = {'gamma': -1.3333e-4, 'beta': -0.05, 'J': 25, 'J_s': 50, 'j_0': 17, 'd': 0.0380}
    for design, row in ((CASE_I, case_i | common), (CASE_II, case_ii | common)):
        for symbol, value in row.items():
            assert getattr(design, symbol) == pytest.approx(value, rel=3e-5), symbol
        assert design.eta == 1 / 250
        assert design.s_max == 3.0 * design.s_min
    assert (CASE_I.N, CASE_II.N) == (200, 225)


@pytest.mark.parametrize(
    'design', [load_element(name).design for name in ELEMENT_NAMES], ids=ELEMENT_NAMES
)
def test_cells_and_springs_are_those_of_the_paper(design):
    """Site by site, every level at a soft defect, and the substrate's springs in balance."""
    np.testing.assert_allclose(design.alpha, oracle.alpha(design), rtol=1e-15)
    np.testing.assert_allclose(design.s, oracle.s(design), rtol=1e-14)
    shape = oracle.quasi_static(design)
    np.testing.assert_allclose(design.strain_shape, shape, atol=1e-12)  # N eps of the solve
    assert (design.strain_shape[0], design.strain_shape[-1]) == (0.0, 1.0)
    for level in range(design.levels):
        j = design.defect_site(level)
        assert 1 < j < design.N
        assert design.alpha[j - 1] < min(design.alpha[j - 2], design.alpha[j])


@pytest.mark.parametrize('j_0', [0.0, 17.0, -33.0, 17.5, 1e6])
def test_eq_2_holds_for_any_offset(j_0):
    design = replace(CASE_II, j_0=j_0)
    np.testing.assert_allclose(design.s, oracle.s(design), rtol=1e-9)


def test_case_ii_has_the_eight_levels_of_the_paper():
    assert CASE_II.levels == 8
    assert CASE_II.bits == 3
    pinning_sites = [CASE_II.defect_site(level) - 100 for level in range(8)]
    assert pinning_sites == [-75, -50, -25, 0, 25, 50, 75, 100]  # x of Fig. 4
    codes = [CASE_II.code(level) for level in range(8)]
    assert codes == ['000', '001', '010', '011', '100', '101', '110', '111']


@pytest.mark.parametrize(
    ('N', 'J', 'levels', 'bits', 'last_code'),
    [
        (200, 100, 1, 0, '0'),  # Case I; the defect at the very end counts for nothing
        (201, 100, 2, 1, '1'),
        (200, 25, 7, 2, '110'),  # Fig. 3b; beyond 2^m codes just grow
        (226, 25, 9, 3, '1000'),
        (26, 25, 1, 0, '0'),
        (1025, 2, 512, 9, '1' * 9),
    ],
)
def test_levels_and_bits_follow_from_length_and_spacing(N, J, levels, bits, last_code):
    design = replace(CASE_II, N=N, J=J)
    assert (design.levels, design.bits) == (levels, bits)
    assert design.code(levels - 1) == last_code


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'J': 225}, r'J must be at most N - tail - 1 = 224, or no level fits; got 225'),
        ({'tail': 200}, r'J must be at most N - tail - 1 = 24, .*; got 25'),
        ({'s_min': 9.9}, r's_min must be far above max\(k_r, k_s\) = 1 .*10 times.*; got 9\.9'),
        ({'d': 8.0}, r's_min must be far above max\(k_r, k_s\) = 124\.4 .*; got 1000'),
        ({'J': 225, 's_min': 1.0}, r'J must be'),
    ],
    ids=str,
)
def test_chain_that_is_no_memory_is_rejected_as_one(changes, message):
    chain = replace(CASE_II, **changes)  # which a simulation without a device takes
    with pytest.raises(DesignError, match=f'^{message}'):
        chain.require_memory()


@pytest.mark.parametrize(
    'changes',
    [
        {'N': 3, 'J': 2}, {'J': 224}, {'gamma': -0.99 / 225}, {'gamma': 1.0}, {'beta': -0.999},
        {'s_min': 10.0}, {'eta': 0}, {'b': 0.0}, {'b': 1e-320}, {'phase': 0}, {'phase': -3},
    ],
    ids=str,
)  # fmt: skip
def test_design_at_edge_of_rules_is_accepted(changes):
    design = replace(CASE_II, **changes)
    assert design.alpha.min() > 0.0
    assert design.D_s1 < design.D_barrier < design.D_s2
    assert design.k_s1 > 0.0
    assert design.k_s2 > 0.0


def test_design_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        CASE_II.N = 200  # type: ignore[misc]
    for array in (CASE_II.sites, CASE_II.alpha, CASE_II.s, CASE_II.strain_shape):
        with pytest.raises(ValueError, match='read-only'):
            array[0] = 0.0


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        *(
            ({symbol: value}, f'{symbol} must be .* got ')
            for symbol, value in (
                ('N', 2), ('N', 225.0), ('N', True), ('J', 1), ('J_s', 0), ('j_0', math.nan),
                ('gamma', math.inf), ('gamma', -1 / 225), ('beta', -1.0), ('beta', 11.0),
                ('a', 0.0), ('a', -0.2582), ('b', 'x'), ('c', None), ('d', 0.0), ('s_max', 999.0),
                ('eta', -1e-3), ('phase', 1.0), ('phase', 101), ('substrate', 'soft'),
            )
        ),
        ({'profile': '0.5 0.2', 'beta': 0.0}, r'profile must be an odd number .*; got 2'),
        ({'profile': '0.5 0.2 0.5'}, r'beta must be 0 with a profile, .*; got -0\.05'),
        ({'b': -0.1}, r'ground states 1 and 2: b must be .* no ground state 1: .* -0\.1'),
        ({'a': 1.0, 'b': -1e-3}, r'ground states 1 and 2: b must be .* no ground state 2'),
        ({'N': 1, 'eta': -1, 'substrate': ''}, r'N must be'),
        ({'beta': -1.0, 's_max': 1.0}, r'beta must be'),
    ],
    ids=str,
)  # fmt: skip
def test_wrong_design_is_rejected_with_its_first_reason(changes, message):
    with pytest.raises(DesignError, match=f'^{message}'):
        replace(CASE_II, **changes)
