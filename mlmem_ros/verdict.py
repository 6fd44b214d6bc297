# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The result of a check, of a machine or of a design."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum


class Verdict(Enum):
    """The result of a check."""

    PASS = 'pass'
    WARN = 'warn'
    FAIL = 'fail'


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the most severe of some verdicts; PASS for none."""
    gravity = list(Verdict)
    return max(verdicts, key=gravity.index, default=Verdict.PASS)
