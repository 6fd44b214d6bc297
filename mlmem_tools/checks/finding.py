# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One finding of a design check, and a report of them all."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mlmem_ros.host.design_check import Verdict, worst


@dataclass(frozen=True)
class Finding:
    """One quantity of a design, judged.

    Attributes:
        values: Numbers by name, all in one unit; NaN for one that does not exist.
        unit: Unit symbol; empty for counts and ratios.
        verdict: Whether the memory will work.
        text: What it means; if it is not a pass, what goes wrong and what to change.
        source: The sentence of the paper that it rests on.
    """

    name: str
    values: Mapping[str, float]
    unit: str
    verdict: Verdict
    text: str
    source: str

    def as_dict(self) -> dict[str, Any]:
        """Return the finding for JSON, with None for NaN."""
        values = {key: v if math.isfinite(v) else None for key, v in self.values.items()}
        return {
            'name': self.name, 'values': values, 'unit': self.unit,
            'verdict': self.verdict.value, 'text': self.text, 'source': self.source,
        }  # fmt: skip


@dataclass(frozen=True)
class Report:
    """All findings about a design and its settings."""

    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """The most severe verdict."""
        return worst(finding.verdict for finding in self.findings)

    def of(self, verdict: Verdict) -> list[Finding]:
        """Return the findings with one verdict."""
        return [finding for finding in self.findings if finding.verdict is verdict]

    def __getitem__(self, name: str) -> Finding:
        """Return a finding by its name; `KeyError` if there is none."""
        for finding in self.findings:
            if finding.name == name:
                return finding
        raise KeyError(name)


def graded(
    name: str,
    values: Mapping[str, float],
    unit: str,
    verdict: Verdict,
    good: str,
    bad: str,
    source: str,
) -> Finding:
    """Return a finding with the text `good` if it is a pass, else `bad`."""
    text = good if verdict is Verdict.PASS else bad
    return Finding(name, values, unit, verdict, text, source)


def judged(value: float, fail_below: float, warn_below: float) -> Verdict:
    """Return the verdict on a value that should be large; NaN fails."""
    if not value >= fail_below:
        return Verdict.FAIL
    return Verdict.PASS if value >= warn_below else Verdict.WARN
