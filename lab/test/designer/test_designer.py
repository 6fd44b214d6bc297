# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a design; `lab/test/studies/test_proof.py` simulates what is found.

The shipped elements are those that the designer finds, but for the times and peaks of a write
(and the rate that they ask of the actuator), which a search made shorter than the designer's rule.
"""

import dataclasses

import pytest
from sampled import sampled

from mlmem import preset
from mlmem.instrument.motion import Cycle
from mlmem.physics.waves import wave_frequency
from mlmem_lab.designer import DesignNotFound, propose_design
from mlmem_tools.checks import Verdict

BITS = pytest.mark.parametrize('bits', sampled((1, 2, 4), lambda bits: bits == 4))


def duration(settings):
    return Cycle.plan_cycle(settings.write, 1.0).duration


@BITS
def test_the_designer_finds_what_is_shipped(bits, proposed):
    found = proposed(2**bits)
    design, settings = preset(f'bits_{bits}')
    assert found.design == design
    searched = {group: getattr(settings, group) for group in ('write', 'actuator')}
    assert dataclasses.replace(found.settings, **searched) == settings
    assert duration(settings) <= duration(found.settings)
    assert design.levels == 2**bits
    assert design.bits == bits
    assert found.report.verdict is not Verdict.FAIL


def test_the_carrier_is_clear_of_the_gratings_gaps(proposed):
    """A grating of period J throws back kappa = n pi / J; the pulse is narrower than the way."""
    found = proposed(16)
    probe, J = found.settings.probe_right, found.design.J
    gaps = wave_frequency([3.141592653589793 * n / J for n in range(1, J)], found.design.k_s1)
    assert min(abs(gaps - probe.omega_c)) > 1.5 / probe.sigma


@pytest.mark.parametrize('levels', [1, 0, -4, 257, 4.0, True, None])
def test_other_numbers_of_levels_are_refused(levels):
    with pytest.raises(DesignNotFound, match='levels must be a whole number from 2 to 256'):
        propose_design(levels)
