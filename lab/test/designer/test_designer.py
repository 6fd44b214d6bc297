# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a design; `lab/test/studies/test_proof.py` simulates what is found.

The shipped elements are those that the designer finds, but for the times and peaks of a write
(and the rate that they ask of the actuator), which a search made shorter than the designer's rule.
"""

import dataclasses

import pytest
from sampled import sampled

from mlmem_lab.designer import DesignNotFound, propose, searched
from mlmem_lab.designer.stroke_search import going_back
from mlmem_ros.device import Settings, preset
from mlmem_ros.device.motion import Cycle
from mlmem_ros.device.move_settings import StrokeSettings, ThrowSettings
from mlmem_ros.device.moves import How, cycle_of, moves_from
from mlmem_ros.physics import CASE_II
from mlmem_ros.physics.waves import frequency
from mlmem_tools.checks import Verdict
from mlmem_tools.checks.bare import moved

BITS = pytest.mark.parametrize('bits', sampled((1, 2, 4, 5, 6, 8), lambda bits: bits == 4))


def duration(settings):
    return Cycle.planned(settings.write, 1.0).duration


@BITS
def test_the_designer_finds_what_is_shipped(bits, proposed):
    found = proposed(2**bits)
    design, settings = preset(f'bits_{bits}')
    assert found.design == design
    groups = ('write', 'actuator', 'throw', *(('down_even', 'down_odd') if bits > 5 else ()))
    searched = {group: getattr(settings, group) for group in groups}
    erase = dataclasses.replace(found.settings.erase, method=settings.erase.method)
    assert dataclasses.replace(found.settings, erase=erase, **searched) == settings
    assert duration(settings) <= duration(found.settings)
    assert design.levels == 2**bits
    assert design.bits == bits
    assert found.report.verdict is not Verdict.FAIL


@pytest.mark.parametrize('name', ['bits_2', 'bits_4', 'bits_5'])
def test_the_rules_strokes_and_throws_take_walls_down(name):
    design, shipped = preset(name)
    settings = going_back(design, dataclasses.replace(shipped, throw=ThrowSettings()))
    assert settings.throw.peak > 0.0
    for level in range(0, design.levels, 5):
        for move in moves_from(design, settings, level):
            if move.how in (How.STROKE, How.THROW):
                after = moved(design, cycle_of(design, settings, move), level, dt=1.0)
                assert after == move.target


def test_without_a_window_there_is_no_throw():
    design, settings = preset('bits_6')
    assert going_back(design, settings).throw.peak == 0.0


@pytest.mark.slow
def test_a_search_changes_only_the_moves_that_exist():
    pytest.importorskip('cmaes')
    design, settings = preset('bits_2')
    plain = dataclasses.replace(settings, throw=ThrowSettings())
    assert searched(design, dataclasses.replace(plain, down_odd=StrokeSettings()), 1) == (
        dataclasses.replace(plain, down_odd=StrokeSettings())
    )
    found = searched(design, plain, 1)
    assert dataclasses.replace(found, down_odd=settings.down_odd) == plain


def test_three_bits_are_the_papers():
    design, settings = preset('bits_3')
    back = (
        'actuator',
        'erase',
        'down_even',
        'down_odd',
        'up_even',
        'up_odd',
        'throw',
        'kick',
        'push',
    )
    plain = {group: getattr(Settings(), group) for group in back}
    assert (design, dataclasses.replace(settings, **plain)) == (CASE_II, Settings())


def test_the_carrier_is_clear_of_the_gratings_gaps(proposed):
    """A grating of period J throws back kappa = n pi / J; the pulse is narrower than the way."""
    found = proposed(16)
    probe, J = found.settings.probe_right, found.design.J
    gaps = frequency([3.141592653589793 * n / J for n in range(1, J)], found.design.k_s1)
    assert min(abs(gaps - probe.omega_c)) > 1.5 / probe.sigma


@pytest.mark.parametrize('levels', [1, 0, -4, 257, 4.0, True, None])
def test_other_numbers_of_levels_are_refused(levels):
    with pytest.raises(DesignNotFound, match='levels must be a whole number from 2 to 256'):
        propose(levels)
