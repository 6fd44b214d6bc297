# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standard problems of mechanical domain walls; docs/standard_problems.md states them."""

from . import echo, kink, pinning, real_lattice, speed_law, throw
from .problem import Answers, Problem

PROBLEMS = (
    kink.PROBLEM, speed_law.PROBLEM, real_lattice.PROBLEM, pinning.PROBLEM, echo.PROBLEM,
    throw.PROBLEM,
)  # fmt: skip
"""In the order of the page."""

__all__ = ['PROBLEMS', 'Answers', 'Problem']
