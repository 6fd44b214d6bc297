# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Solve all problems and write our answers: python3 -m mlmem_lab.standard_problems."""

from . import ALL_PROBLEMS
from .problem import ANSWERS_FILE, solve_problem, write_answers

write_answers(
    ANSWERS_FILE, [answer for problem in ALL_PROBLEMS for answer in solve_problem(problem)]
)
