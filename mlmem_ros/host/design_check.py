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

if TYPE_CHECKING:  # the choices are known without ROS
    from .journal import Journal

CHOICES = ('refuse', 'warn', 'skip')
"""What to do about a design that fails: refuse to configure, warn, or skip the check."""

SKIP = 'skip'


def check_design(design: Design, settings: Settings, mode: str, log: Journal) -> None:
    """Check a design and log every finding that is not a pass.

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
            f'the design fails its check ({"; ".join(failed)}). `mlmem design check` shows '
            'all findings; with design.check: warn it starts anyway'
        )
    for text in failed:
        log.error(f'design check: {text}')
    for finding in report.of(Verdict.WARN):
        log.warning(f'design check: {finding.name}: {finding.text}')


@lru_cache(maxsize=16)  # a node is mostly configured again without changes
def findings(design: Design, settings: Settings) -> Report:
    """Return the findings of a check, new or cached; passes may be left out."""
    if (report := kept_checks.kept(design, settings)) is None:
        report = check(design, settings)
        kept_checks.keep(design, settings, report)
    return report
