# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a comparison: bars, or lines over the axis of a scaling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..studies.style import FAINT, INK, MARK, S2, axes_grid, new_figure, styled
from .comparison import Comparison
from .measure import Entry


def draw(comparison: Comparison, path: Path) -> Path:
    """Draw a comparison and save it; return the path."""
    with styled():
        figure = _lines(comparison) if comparison.axis else _bars(comparison)
        figure.suptitle(comparison.title, x=0.01, ha='left', fontsize=9)
        figure.savefig(path, dpi=130, metadata={'Software': None})
    return path


def _bars(comparison: Comparison) -> Any:
    entries = comparison.entries
    figure = new_figure(6.5, 0.7 + 0.32 * len(entries))
    axes = axes_grid(figure)[0, 0]
    for row, entry in enumerate(entries):
        spread = entry.spread
        axes.barh(row, spread.median, color=S2 if row == 0 else FAINT, height=0.6)
        axes.plot((spread.low, spread.high), (row, row), color=INK, lw=1.2)
        ratio = '' if row == 0 else f'  ({comparison.ratio(entry).median:.3g} times)'
        axes.annotate(f'{spread.median:.3g}{ratio}', (spread.high, row), (4, 0),
                      textcoords='offset points', va='center', fontsize=7)  # fmt: skip
    medians = [entry.spread.median for entry in entries]
    if max(medians) > 30.0 * min(medians):
        axes.set_xscale('log')
    axes.margins(x=0.25)
    axes.set_yticks(range(len(entries)), [entry.name for entry in entries])
    axes.invert_yaxis()
    axes.set_xlabel(comparison.unit)
    return figure


def _lines(comparison: Comparison) -> Any:
    figure = new_figure(5.0, 3.2)
    axes = axes_grid(figure)[0, 0]
    names = list(dict.fromkeys(entry.name for entry in comparison.entries))
    colors = dict(zip(names, (S2, MARK, INK, FAINT, 'C2', 'C4'), strict=False))
    for name in names:
        entries: list[Entry] = [entry for entry in comparison.entries if entry.name == name]
        x = [entry.x for entry in entries]
        spreads = [entry.spread for entry in entries]
        axes.plot(x, [s.median for s in spreads], 'o-', ms=3, color=colors.get(name), label=name)
        axes.fill_between(x, [s.low for s in spreads], [s.high for s in spreads],
                          color=colors.get(name), alpha=0.25, lw=0)  # fmt: skip
    axes.set(xscale='log', xlabel=comparison.axis, ylabel=comparison.unit)
    if comparison.measured:
        axes.set_ylim(0.0, None)
    else:
        axes.set_yscale('log')
    axes.legend()
    return figure
