# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a design; `lab/test/studies/test_proof.py` simulates what is found.

The shipped elements are those that the designer finds, but for the times and peaks of a write
(and the rate that they ask of the actuator), which a search made shorter than the designer's rule.
"""

import dataclasses

import pytest
from sampled import sampled

from mlmem import load_element
from mlmem.instrument.motion import Cycle
from mlmem_lab.designer import DesignNotFound, propose_design
from mlmem_tools.checks import Verdict

BITS = pytest.mark.parametrize('bits', sampled((1, 2, 4), lambda bits: bits == 4))


def duration(settings):
    return Cycle.plan_cycle(settings.write, 1.0).duration


@BITS
def test_the_designer_finds_what_is_shipped(bits, proposed):
    found = proposed(2**bits)
    design, settings = load_element(f'bits_{bits}').design_and_settings
    assert found.design == design
    searched = {group: getattr(settings, group) for group in ('write', 'actuator')}
    assert dataclasses.replace(found.settings, **searched) == settings
    assert duration(settings) <= duration(found.settings)
    assert design.levels == 2**bits
    assert design.bits == bits
    assert found.report.verdict is not Verdict.FAIL


@pytest.mark.parametrize('levels', [1, 0, -4, 257, 4.0, True, None])
def test_other_numbers_of_levels_are_refused(levels):
    with pytest.raises(DesignNotFound, match='levels must be a whole number from 2 to 256'):
        propose_design(levels)
