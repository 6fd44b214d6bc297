# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a concern of the design check takes and yields: its subject, with the quantities that
several concerns share; findings, and a report of them all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, lru_cache

from mlmem.physics import Design, Specimen, StateError, wall_energy
from mlmem.readers.calibration import PulseCorrection
from mlmem.settings import Settings

from .quasistatic import Landscape, compute_held_landscape, find_depinning_strain


class Verdict(Enum):
    """The result of a check."""

    PASS = 'pass'
    WARN = 'warn'
    FAIL = 'fail'


def find_worst_verdict(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the most severe of some verdicts; PASS for none."""
    gravity = list(Verdict)
    return max(verdicts, key=gravity.index, default=Verdict.PASS)


@dataclass(frozen=True)
class Finding:
    """One quantity of a design, judged.

    Attributes:
        values: Numbers by name, all in one unit; NaN for one that does not exist.
        unit: Unit symbol; empty for counts and ratios.
        verdict: Whether the memory will work.
        text: What it means; if it is not a pass, what goes wrong and what to change.
    """

    name: str
    values: Mapping[str, float]
    unit: str
    verdict: Verdict
    text: str


@dataclass(frozen=True)
class Report:
    """All findings about a design and its settings."""

    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """The most severe verdict."""
        return find_worst_verdict(finding.verdict for finding in self.findings)

    def of(self, verdict: Verdict) -> list[Finding]:
        """Return the findings with one verdict."""
        return [finding for finding in self.findings if finding.verdict is verdict]

    def __getitem__(self, name: str) -> Finding:
        """Return a finding by its name; `KeyError` if there is none."""
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(name)


def grade_finding(
    name: str,
    values: Mapping[str, float],
    unit: str,
    verdict: Verdict,
    good: str,
    bad: str,
) -> Finding:
    """Return a finding with the text `good` if it is a pass, else `bad`."""
    text = good if verdict is Verdict.PASS else bad
    return Finding(name, values, unit, verdict, text)


def judge_value(value: float, fail_below: float, warn_below: float) -> Verdict:
    """Return the verdict on a value that should be large; NaN fails."""
    if not value >= fail_below:
        return Verdict.FAIL
    return Verdict.PASS if value >= warn_below else Verdict.WARN


LAUNCH_LEVEL = -1
"""Pseudo-level from which a launched wall comes to level 0."""

MAX_CELL_STEPS = 1e9
"""Most cell steps that the simulations for one finding may take: some seconds."""

MIN_STEP_CELLS = 100
"""A step of a shorter chain takes as long as that of one with this many cells."""


@dataclass(frozen=True)
class Subject:
    """A design and the settings of its instrument; or one element of the design, and its pulses.

    Attributes:
        corrections: Factors on the launch and the steps of a write, by level; none: 1.

    Sampled levels are both kinds of site at the start, in the middle and at the end.
    """

    design: Design
    settings: Settings
    element: Specimen | None = None
    corrections: tuple[PulseCorrection, ...] = ()

    @cached_property
    def made(self) -> Specimen:
        """The element."""
        return self.element or Specimen(self.design)

    @cached_property
    def levels(self) -> list[int]:
        """Sampled levels."""
        return sample_levels(self.design.levels)

    @cached_property
    def steps(self) -> list[int]:
        """Sampled levels from which a wall has to step on."""
        return sample_levels(self.design.levels - 1)

    def gradient_force_at(self, site: float) -> float:
        """Return the mean force of the gradient on a wall, positive to the right.

        It is -gamma E / (2 alpha) with the alpha and the energy E of the site: half of a wall's
        energy is in the potential, only that is graded, and E grows with the root of alpha.
        """
        gamma = self.design.gamma
        return -0.5 * gamma * wall_energy(self.design) / math.sqrt(1.0 + gamma * site)

    def release_site(self, level: int) -> float:
        """Return the site from which a wall rolls on to the next level once the strain is zero.

        A step ends at the extremum of s ahead, a launch at the least s before level 0.
        """
        if level == LAUNCH_LEVEL:
            return self.design.J - (self.design.J - self.design.j_0) % self.design.J_s
        defect, half = self.design.defect_site(level), 0.5 * self.design.J_s
        return defect + half - (defect - self.design.j_0) % half

    @cached_property
    def landscapes(self) -> dict[int, Landscape]:
        """Landscapes without strain from release to the next defect, by the level from which a
        wall rolls on; by `LAUNCH_LEVEL` alone if there is a single level.

        Raises:
            StateError: A wall cannot be held there.
        """
        found = {}
        for level in self.steps or [LAUNCH_LEVEL]:
            goal = self.design.defect_site(level + 1) - 1.0
            start = min(max(self.release_site(level), 2.0), goal - 1.0)
            found[level] = compute_held_landscape(self.made, start, goal)
        return found

    def forward(self, *, kink: bool) -> dict[int, float]:
        """Return the strains that move a wall or a kink on, by the sampled level that it leaves.

        They are NaN where no strain frees it, or the level pins none.
        """
        made, found = self.element or self.design, {}
        for level in self.steps:
            by_compression = self.design.is_freed_by_compression(level) is not kink
            found[level] = _find_freeing_strain(made, level, -1.0 if by_compression else 1.0, kink)
        return found


@lru_cache(maxsize=256)  # whatever the instrument is set to
def _find_freeing_strain(made: Design | Specimen, level: int, sign: float, kink: bool) -> float:
    try:
        return find_depinning_strain(made, level, sign, largest=0.12, kink=kink, tolerance=1e-4)
    except StateError:
        return math.nan


def sample_levels(count: int) -> list[int]:
    """Return some of 0 ... count - 1: two neighbours at the start, the middle and the end."""
    if count <= 6:
        return list(range(max(0, count)))
    middle = count // 2
    return [0, 1, middle, middle + 1, count - 2, count - 1]
