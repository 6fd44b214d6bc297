# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a check ends, be it of a machine or of a design."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum


class Verdict(Enum):
    """How a check ended."""

    PASS = 'pass'
    WARN = 'warn'
    FAIL = 'fail'


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the gravest of some verdicts; PASS for none."""
    gravity = list(Verdict)
    return max(verdicts, key=gravity.index, default=Verdict.PASS)
