# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design check of a node that is being configured: warnings in its log, or a refusal."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from ..analysis.checks import Report, Verdict, check
from ..device import Settings
from ..physics import Design, DesignError
from . import kept_checks

if TYPE_CHECKING:  # what may be chosen is told without ROS
    from .journal import Journal

CHOICES = ('refuse', 'warn', 'skip')
"""What to do about a design that fails: not to configure, to say so, not to look."""

SKIP = 'skip'

WAS_SKIP = 'off'
"""The word of 0.1, which YAML 1.1 reads as false; both are understood for one release."""


def check_design(design: Design, settings: Settings, mode: str, log: Journal) -> None:
    """Check a design and log what is not a pass.

    Args:
        design: The element.
        settings: The instrument's settings.
        mode: One of `CHOICES`.
        log: Where warnings go.

    Raises:
        DesignError: The design fails, and the mode is 'refuse'.
    """
    if mode == SKIP:
        return
    report = findings(design, settings)
    failed = [f'{finding.name}: {finding.text}' for finding in report.of(Verdict.FAIL)]
    if failed and mode == 'refuse':
        raise DesignError(
            f'the design fails its check ({"; ".join(failed)}). `mlmem design check` tells all; '
            'with design.check: warn it starts all the same'
        )
    for text in failed:
        log.error(f'design check: {text}')
    for finding in report.of(Verdict.WARN):
        log.warning(f'design check: {finding.name}: {finding.text}')


@lru_cache(maxsize=16)  # who configures a node again has mostly changed nothing
def findings(design: Design, settings: Settings) -> Report:
    """Return what a check finds, or once found; what is a pass may be left out."""
    if (report := kept_checks.kept(design, settings)) is None:
        report = check(design, settings)
        kept_checks.keep(design, settings, report)
    return report
