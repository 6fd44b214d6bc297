# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standard problems: the committed answers."""

import pytest

from mlmem_lab.standard_problems import ALL_PROBLEMS
from mlmem_lab.standard_problems.problem import ANSWERS_FILE, read_answers

ANSWERS = {(each.problem, each.quantity): each for each in read_answers(ANSWERS_FILE)}


@pytest.mark.parametrize('problem', ALL_PROBLEMS, ids=lambda each: each.name)
def test_committed_answers_are_those_of_longer_steps(problem):
    """Twice the step, whose error is below 0.1 %."""
    found = problem.solve(2.0 * problem.step)
    assert {name for kind, name in ANSWERS if kind == problem.name} == set(found)
    for name, value in found.items():
        ours = ANSWERS[problem.name, name]
        limit = max(1e-3 * abs(ours.value), 10.0 * ours.error)
        assert value == pytest.approx(ours.value, rel=0.0, abs=limit), name
