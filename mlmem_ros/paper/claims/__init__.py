# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's checkable sentences, each judged by the data of our figures."""

from __future__ import annotations

from . import landscape, memory, potential, substrate, waves
from .claim import Claim, Finding, Verdict

CLAIMS: tuple[Claim, ...] = (
    *potential.CLAIMS,
    *landscape.CLAIMS,
    *waves.CLAIMS,
    *memory.CLAIMS,
    *substrate.CLAIMS,
)
"""All claims in the order of the paper."""

__all__ = ['CLAIMS', 'Claim', 'Finding', 'Verdict']
