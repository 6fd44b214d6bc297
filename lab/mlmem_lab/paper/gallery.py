# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All figures in the order of the paper, ours behind them, and all claims by page."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path

from .figure import Figure, PaperClaim, Quality

FIGURES_BY_NAME: dict[str, Figure] = {
    figure.name: figure
    for file in (
        'fig_1c', 'fig_2a', 'fig_2b', 'fig_2c', 'fig_3a', 'fig_3b', 'fig_4a', 'fig_4b', 'fig_5',
        'mov_s1', 'printed', 'gradient', 'carriers', 'peaks', 'launches', 'rigidity', 'design',
        'kicked', 'byte', 'robust',
    )
    for figure in [importlib.import_module(f'.figures.{file}', __package__).definition]
}  # fmt: skip
"""The `definition` of each file of the folder `figures`, in the order of the paper."""


def list_claims() -> list[PaperClaim]:
    """Return the claims of all figures by page."""
    claims = (claim for figure in FIGURES_BY_NAME.values() for claim in figure.claims)
    return sorted(claims, key=lambda claim: claim.page)


def select_figures(names: Sequence[str]) -> list[Figure]:
    """Return the named figures in the order of the paper; all of them for no name.

    Raises:
        KeyError: There is no such figure; the message lists those that are.
    """
    if unknown := [name for name in names if name not in FIGURES_BY_NAME]:
        raise KeyError(f'figure must be one of {", ".join(FIGURES_BY_NAME)}; got {unknown[0]!r}')
    return [each for name, each in FIGURES_BY_NAME.items() if not names or name in names]


def make_figure(name: str, quality: Quality, folder: Path) -> dict[str, list[Path]]:
    """Compute, draw and save one figure in a folder; return files by name."""
    figure = FIGURES_BY_NAME[name]
    return {name: figure.save(figure.compute(quality), folder)}
