# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design check of a node that is being configured: warnings in its log, or a refusal."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from ..analysis.checks import Report, Verdict, check
from ..device import Settings
from ..physics import Design, DesignError

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
    report = _checked(design, settings)
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


@lru_cache(
    maxsize=16
)  # it takes a second, and who configures a node again has mostly changed nothing
def _checked(design: Design, settings: Settings) -> Report:
    return check(design, settings)
