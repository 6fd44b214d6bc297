# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What may have changed in an element since its survey, and how that is said."""

from __future__ import annotations

from dataclasses import dataclass

from mlmem_ros.device.end import End

LINEAR = 0.3
"""Relative change of a cell up to which the residual is proportional to it."""


@dataclass(frozen=True)
class Kind:
    """Something that may change.

    Attributes:
        words: What has happened, with gaps for its place and its size in per cent.
        least: Least change that matters, relative, or of the strain: a fit leaves smaller ones
            open.
    """

    words: tuple[str, str]
    least: float


CELL = Kind(('cell {} has become {:.2g} % weaker', 'cell {} has become {:.2g} % stiffer'), 0.01)

SHARED_KINDS = {
    'eta': Kind(('damping has fallen by {1:.2g} %', 'damping has risen by {1:.2g} %'), 0.05),
    'strain': Kind(
        ('the strain is {1:.2g} % below what it should be', 'the strain is {1:.2g} % too high'),
        5e-4,
    ),
    'time_unit': Kind(('the clock is {1:.2g} % faster', 'the clock is {1:.2g} % slower'), 0.001),
    **{
        f'{name}_{end}': Kind(
            (
                f'the {end} {part} has fallen by {{1:.2g}} %',
                f'the {end} {part} has risen by {{1:.2g}} %',
            ),
            0.01,
        )
        for name, part in (('gain', 'gain'), ('drive', 'pulse'))
        for end in End
    },
}
"""By the name of the unknown. A gain is that of a transducer, which moves its end by what it
measures; a pulse may be smaller than that."""


@dataclass(frozen=True)
class Change:
    """What has changed since the survey.

    Attributes:
        name: 'cell', or a name of `SHARED_KINDS`.
        site: Site of the cell; 0 for what all cells share.
        amount: Relative change, or that of the strain.
        deviation: Its standard deviation.
    """

    name: str
    site: int
    amount: float
    deviation: float

    def __str__(self) -> str:
        if self.site and abs(self.amount) > LINEAR:
            return f'cell {self.site} is not what it was at the survey: stuck, or broken'
        kind = SHARED_KINDS.get(self.name, CELL)
        words = kind.words[int(self.amount > 0.0)]
        return f'{words.format(self.site, 100.0 * abs(self.amount))} since the survey'
