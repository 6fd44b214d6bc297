# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design checker: what a second of computing can say about a design before any write.

It uses closed forms, equilibria and linear waves; only the launch and some steps need short runs.
"""

from __future__ import annotations

from ...device.settings import Settings
from ...physics import Design
from ...verdict import Verdict
from . import drift, echo_range, echoes, launch, material, pinning, schedule, steps, wall, waves
from .finding import Finding, Report
from .subject import Subject

__all__ = ['Finding', 'Report', 'Verdict', 'check']

CONCERNS = (material, waves, wall, pinning, drift, launch, schedule, steps, echo_range, echoes)
"""Modules with `check(subject)`, in the order of a report."""


def check(design: Design, settings: Settings | None = None) -> Report:
    """Judge a design and the settings of its instrument.

    Args:
        design: The element.
        settings: The instrument's settings, by default those for the paper's Case II.
    """
    subject = Subject(design, settings or Settings())
    return Report(tuple(finding for concern in CONCERNS for finding in concern.check(subject)))
