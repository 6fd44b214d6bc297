# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a benchmark returns, and how it is printed."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .host import describe_host
from .measure import Entry, Spread

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True)
class Comparison:
    """Contenders that did the same work, measured side by side.

    Attributes:
        name: Stem of its files.
        title: What is compared.
        unit: Unit of the cost; smaller is better.
        terms: What is equal, and what each contender was given.
        entries: What was measured; ratios are to the first.
        skipped: Who did not take part, and why.
        axis: What `x` of the entries is, for a scaling plot.
        measured: Whether the entries are times, which have a spread and ratios; else results.
    """

    name: str
    title: str
    unit: str
    terms: str
    entries: Sequence[Entry]
    skipped: dict[str, str] = field(default_factory=dict)
    axis: str = ''
    measured: bool = True

    def ratio(self, entry: Entry) -> Spread:
        """Return the cost of an entry over that of the first."""
        return entry.over(self.entries[0])

    def as_dict(self) -> dict[str, Any]:
        """Return everything, every sample included."""
        values = {**dataclasses.asdict(self), 'host': describe_host()}
        if self.measured:
            values['ratios'] = [dataclasses.asdict(self.ratio(entry)) for entry in self.entries]
        return values

    def table(self) -> Table:
        """Return the comparison as a table for a terminal."""
        from rich.table import Table

        table = Table(title=self.title, title_justify='left', caption=self._caption())
        table.caption_justify = 'left'
        table.add_column('contender')
        if self.axis:
            table.add_column(self.axis, justify='right')
        table.add_column(self.unit, justify='right')
        if self.measured:
            table.add_column(f'over {self.entries[0].name}', justify='right')
        extra = list(dict.fromkeys(key for entry in self.entries for key in entry.values))
        for key in extra:
            table.add_column(key, justify='right')
        for entry in self.entries:
            cells = [entry.name]
            if self.axis:
                cells.append('' if entry.x is None else f'{entry.x:,g}')
            cells += (
                [str(entry.spread), str(self.ratio(entry))]
                if self.measured
                else [f'{entry.spread.median:.3g}']
            )
            cells += [f'{entry.values[k]:.3g}' if k in entry.values else '' for k in extra]
            table.add_row(*cells)
        return table

    def _caption(self) -> str:
        lines = [self.terms]
        if self.measured:
            lines.append('median, half the quartile distance; ratios are taken within a round')
        return '\n'.join(lines + [f'{who} skipped: {why}' for who, why in self.skipped.items()])
