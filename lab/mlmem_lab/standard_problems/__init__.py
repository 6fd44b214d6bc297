# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standard problems of mechanical domain walls, for comparing codes.

Sites are counted from 1, masses are 1, and ends are free unless stated. A front is where the
configuration last falls below the barrier, linear between sites. In 1 and 2, everything starts at
rest with u_j = mean - half tanh((j - X) / w), mean and half those of the two wells.

Our answers are those of PEFRL, fourth order, at the step given. The error is the difference from
twice that step.
"""

from .problem import StandardProblem
from .walls import byte, echo, kick, pinning, robust_kick

ALL_PROBLEMS: tuple[StandardProblem, ...] = (pinning, echo, kick, byte, robust_kick)
"""In the order of the page."""

__all__ = ['ALL_PROBLEMS', 'StandardProblem']
