# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The five laws of what the parts of a kicked element may be like."""

import dataclasses
import math

import numpy as np
import pytest

from mlmem import load_element
from mlmem.physics import CASE_II, Potential, wall_energy
from mlmem.physics.wall import next_wall_costs
from mlmem.settings import Settings
from mlmem_tools.checks import Verdict, budget
from mlmem_tools.checks.budget import Budget, judge_request, most_levels_with_friction
from mlmem_tools.checks.concern import Subject
from mlmem_tools.cli.main import main

ROBUST = load_element('robust_3').design


def test_budget_of_robust_3_equals_the_laws_by_hand():
    """E_0 = (8 / pi) sqrt(d) with the paper's potential and a step of 2 cells, within 1 %."""
    found, w = Budget(ROBUST), 0.5 / math.sqrt(ROBUST.d)
    E_0 = 8.0 / math.pi * math.sqrt(ROBUST.d)
    assert found.width == pytest.approx(w, rel=2e-3)
    assert found.kick_energy == pytest.approx(E_0 * (w / 1.97 - 1.0), rel=0.02)
    assert found.scatter == pytest.approx((w / 1.97 - 1.0) / (1.29 * 8), rel=0.01)
    assert found.damping == pytest.approx(math.acosh(w / 1.97) / 64, rel=0.01)
    assert found.friction == pytest.approx(E_0 * (w / 1.97 - 1.0) / (2 * 64), rel=0.02)


def test_pins_and_wells_agree_with_simulated_designs():
    """The paper's defects are 0.7 % of E_0 deep, robust ones 6 to 9 %; wells tolerate 3 to 5 %."""
    assert 0.006 < Budget(CASE_II).pin_depth / wall_energy(CASE_II) < 0.009
    for name in ('robust_2', 'robust_3'):
        design = load_element(name).design
        assert 0.06 < Budget(design).pin_depth / wall_energy(design) < 0.09
        assert 0.03 <= Budget(design).well_scatter <= 0.05


def test_echo_reach_is_that_of_two_simulated_designs():
    """An echo of amplitude 0.5 reached 125 cells at a friction of 1e-3, 22 at 1e-2."""
    for d, friction, reach in ((0.020, 1e-3, 125.0), (0.0803, 1e-2, 22.0)):
        design = dataclasses.replace(ROBUST, d=d, friction=friction)
        low, high = math.sqrt(design.k_s1), math.sqrt(design.k_s2)
        omega = low + 0.62 * (high - low)
        assert Budget(design).echo_reach(omega, 0.5) == pytest.approx(reach, rel=0.15)
    assert Budget(ROBUST).echo_reach(0.4, 0.5) == math.inf


def test_friction_that_stops_every_wall_fails_the_check():
    settings = load_element('robust_3').settings
    for friction, verdict in ((1e-3, Verdict.PASS), (1e-2, Verdict.FAIL)):
        design = dataclasses.replace(ROBUST, friction=friction)
        found = {each.name: each for each in budget.check(Subject(design, settings))}
        assert found['allowed_friction'].verdict is verdict


def test_element_without_kicks_has_no_budget():
    assert not list(budget.check(Subject(CASE_II, Settings())))


@pytest.mark.parametrize(
    ('levels', 'scatter', 'friction', 'failed'),
    [
        (8, 0.03, 1e-3, set()),
        (4, 0.03, 1e-2, set()),
        (8, 0.03, 1e-2, {'levels_by_friction'}),
        (64, 0.03, 0.0, {'levels_by_scatter'}),
        (64, 0.05, 0.1, {'levels_by_scatter', 'levels_by_friction'}),
    ],
)
def test_impossible_request_fails_with_its_reason(levels, scatter, friction, failed):
    """Elements of 4 levels at 1e-2 and of 8 at 1e-3 were simulated."""
    report = judge_request(levels, scatter, friction)
    assert {finding.name for finding in report.of(Verdict.FAIL)} == failed
    assert report.verdict is (Verdict.FAIL if failed else Verdict.PASS)


def test_friction_law_follows_the_measured_reach():
    for friction, levels in ((1e-3, 22.5), (3e-3, 11.5), (1e-2, 5.5)):
        assert most_levels_with_friction(friction) == pytest.approx(levels, rel=0.07)


def test_next_walls_of_the_paper_forbid_words_erased_by_kicks():
    """Below s1 the cubic phase stretches the wall, above s2 it compresses it."""
    below, above = next_wall_costs(CASE_II.potential, CASE_II.phase)
    assert below > 1.0 > above
    assert above == pytest.approx(0.69, abs=0.005)


def test_next_walls_of_two_wells_do_not_exist():
    law = Potential.from_function(lambda D: (1.0 - D * D) ** 2, -1.6, 1.6)
    assert next_wall_costs(law, 0) == (math.inf, math.inf)
    assert np.isfinite(next_wall_costs(CASE_II.potential, 1)).all()


@pytest.mark.parametrize(
    ('request_', 'named'), [('--levels 8 --friction 0.01', 'at most 5 levels'), ('', '--levels')]
)
def test_design_command_rejects_an_impossible_request(request_, named, capsys):
    assert main(['design', '--scatter', '0.03', *request_.split()]) == 2
    assert named in capsys.readouterr().err
