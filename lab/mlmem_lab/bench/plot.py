# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a comparison: bars, or lines over the axis of a scaling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..studies.style import FAINT, INK, S2, axes_grid, new_figure, styled
from .comparison import Comparison


def draw(comparison: Comparison, path: Path) -> Path:
    """Draw a comparison and save it; return the path."""
    with styled():
        figure = new_figure(4.0 if comparison.axis else 1.0 + 0.35 * len(comparison.entries))
        axes = axes_grid(figure)[0, 0]
        (_lines if comparison.axis else _bars)(axes, comparison)
        axes.set_title(comparison.title)
        figure.savefig(path, metadata={'Software': None})
    return path


def _bars(axes: Any, comparison: Comparison) -> None:
    entries = comparison.entries
    for row, entry in enumerate(entries):
        spread = entry.spread
        axes.barh(row, spread.median, color=S2 if row == 0 else FAINT, height=0.6)
        axes.plot((spread.low, spread.high), (row, row), color=INK)
        ratio = '' if row == 0 else f'  ({comparison.ratio(entry).median:.3g} times)'
        axes.annotate(f'{spread.median:.3g}{ratio}', (spread.high, row), (4, 0),
                      textcoords='offset points', va='center')  # fmt: skip
    medians = [entry.spread.median for entry in entries]
    if max(medians) > 30.0 * min(medians):
        axes.set_xscale('log')
    axes.margins(x=0.25)
    axes.set_yticks(range(len(entries)), [entry.name for entry in entries])
    axes.invert_yaxis()
    axes.set_xlabel(comparison.unit)


def _lines(axes: Any, comparison: Comparison) -> None:
    for name in dict.fromkeys(entry.name for entry in comparison.entries):
        entries = [entry for entry in comparison.entries if entry.name == name]
        x, spreads = [entry.x for entry in entries], [entry.spread for entry in entries]
        (line,) = axes.plot(x, [spread.median for spread in spreads], 'o-', ms=3, label=name)
        low, high = [spread.low for spread in spreads], [spread.high for spread in spreads]
        axes.fill_between(x, low, high, color=line.get_color(), alpha=0.25, lw=0)
    axes.set(xscale='log', xlabel=comparison.axis, ylabel=comparison.unit)
    if comparison.measured:
        axes.set_ylim(0.0, None)
    else:
        axes.set_yscale('log')
    axes.legend()
