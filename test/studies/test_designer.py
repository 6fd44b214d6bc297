# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a design, and what simulation says of it.

The shipped elements are those that the designer finds, but for the times and peaks of a write
(and the rate that they ask of the actuator), which a search made shorter than the designer's rule;
they do what their table says.
"""

import dataclasses

import pytest

from mlmem_ros.device import Calibration, Settings, preset
from mlmem_ros.device.checks import Verdict, check
from mlmem_ros.device.settings import EraseSettings, WriteSettings
from mlmem_ros.device.steps_up import scaled
from mlmem_ros.device.strain_cycle import StrainCycle
from mlmem_ros.parameter_file import load, parse, text_of
from mlmem_ros.physics import CASE_II
from mlmem_ros.physics.dispersion import frequency
from mlmem_ros.studies.designer import DesignNotFound, Proof, Tally, propose
from mlmem_ros.studies.designer.listening import CLEAR
from mlmem_ros.studies.upward import writes

QUICK, LARGE = (1, 2, 4), (5, 6, 8)
BITS = pytest.mark.parametrize(
    'bits', [*QUICK, *(pytest.param(bits, marks=pytest.mark.slow) for bits in LARGE)]
)


def duration(settings):
    return StrainCycle.planned(settings.write, 1.0).duration


@BITS
def test_the_designer_finds_what_is_shipped(bits):
    found = propose(2**bits)
    design, settings = preset(f'bits_{bits}')
    assert found.design == design
    searched = {'write': settings.write, 'actuator': settings.actuator}
    assert dataclasses.replace(found.settings, **searched) == settings
    assert duration(settings) <= duration(found.settings)
    assert design.levels == 2**bits
    assert design.bits == bits
    assert found.report.verdict is not Verdict.FAIL


def test_four_levels_are_found_and_proven():
    """Every level up, every downward write, every erase, each at the first attempt."""
    found = propose(4)
    study = Proof(found.design, found.settings).campaign()
    tally = Tally.of(study.evaluate_point(point) for point in range(len(study.points)))
    assert tally.errors == ()
    assert (tally.levels, tally.of_levels) == (4, 4)
    assert (tally.downs, tally.of_downs) == (6, 6)  # 1 + 2 + 3
    assert (tally.erases, tally.of_erases) == (4, 4)
    assert tally.level_margin > 0.5


@pytest.mark.parametrize('levels', [2, 3, 7, pytest.param(24, marks=pytest.mark.slow)])
def test_both_peaks_of_a_write_may_be_off_by_three_tenths(levels):
    """The plain schedule of the paper's element fails there."""
    found = propose(levels)
    for factors in ((0.7, 0.7), (0.7, 1.3), (1.3, 0.7), (1.3, 1.3)):
        assert all(writes(found.design, scaled(found.settings.write, *factors)))


def test_three_bits_are_the_papers():
    assert preset('bits_3') == (CASE_II, Settings())


@pytest.mark.parametrize('bits', QUICK)
def test_a_shipped_element_steps_comes_down_and_is_erased(bits):
    """A cheap look at each: its last level erased, which takes the longest, and written down."""
    design, settings = load(f'bits_{bits}')
    study = Proof(design, settings, sample=2).campaign()
    last = [point for point, run in enumerate(study.points) if run['start'] == design.levels - 1]
    assert len(last) == 2
    for point in last:
        assert study.evaluate_point(point)['error'] == ''


@pytest.mark.slow
@pytest.mark.parametrize('bits', range(1, 7))
def test_a_shipped_element_is_proven(bits):
    study = Proof(*load(f'bits_{bits}')).campaign()
    tally = Tally.of(study.evaluate_point(point) for point in range(len(study.points)))
    assert tally.errors == ()
    assert tally.levels == 2**bits


def test_all_downward_writes_are_tried_up_to_sixteen_levels_and_a_sample_above():
    sixteen, thirty_two = preset('bits_4').design, preset('bits_5').design
    kinds = [run['kind'] for run in Proof(sixteen, Settings()).points()]
    assert (kinds.count('upward'), kinds.count('erase'), kinds.count('down')) == (1, 16, 120)
    runs = Proof(thirty_two, Settings()).points()
    downs = {(run['start'], run['goal']) for run in runs if run['kind'] == 'down'}
    assert len(downs) == 32
    assert {(1, 0), (31, 30)} <= downs  # the first and the last are in it
    assert all(start > goal for start, goal in downs)
    few = [run['kind'] for run in Proof(thirty_two, Settings(), sample=3).points()]
    assert (few.count('erase'), few.count('down')) == (32, 3)


def test_a_design_that_does_not_work_is_told():
    """A tension below what frees the wall leaves it at level 1, a kink that never comes there."""
    design, settings = load('bits_2')
    weak = dataclasses.replace(
        settings,
        write=dataclasses.replace(settings.write, tension=0.012),
        erase=dataclasses.replace(settings.erase, tension=0.005),
    )
    assert check(design, weak).verdict is Verdict.FAIL
    study = Proof(design, weak, sample=1).campaign()
    rows = [study.evaluate_point(point) for point in range(len(study.points))]
    tally = Tally.of(rows)
    assert not tally.passed
    assert tally.levels == 2
    assert 'upward from -1 to 3: level 2' in tally.errors[0]


def test_the_carrier_is_clear_of_the_gratings_gaps():
    """A grating of period J throws back kappa = n pi / J; the pulse is narrower than the way."""
    found = propose(16)
    probe, J = found.settings.probe_right, found.design.J
    gaps = frequency([3.141592653589793 * n / J for n in range(1, J)], found.design.k_s1)
    assert min(abs(gaps - probe.omega_c)) > 1.5 / probe.sigma
    assert found.listening.signal > CLEAR * found.listening.clutter
    assert probe.v_th < found.listening.signal


@pytest.mark.parametrize('levels', [1, 0, -4, 257, 4.0, True, None])
def test_other_numbers_of_levels_are_refused(levels):
    with pytest.raises(DesignNotFound, match='levels must be a whole number from 2 to 256'):
        propose(levels)


def test_a_parameter_file_is_read_back():
    design = dataclasses.replace(CASE_II, N=250, eta=1e-3, gamma=-1e-5, substrate='elastic')
    settings = Settings(
        write=WriteSettings(tension=0.04, attempts=5), erase=EraseSettings(settle=1e5)
    )
    assert parse(text_of(design, settings)) == (design, settings)
    assert text_of(CASE_II, Settings()).split() == [
        '/**:',
        'ros__parameters:',
        'design:',
        'preset:',
        'case_2',
    ]


def test_a_right_only_element_has_no_left_table():
    """What a designed element is read by, and nothing is waited for at the other end."""
    design, settings = load('bits_1')
    calibration = Calibration.from_dict(Proof(design, settings).campaign().common['calibration'])
    assert calibration.left is None
    assert calibration.ends == ('right',)
