# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a figure is: data, drawing, title, and the claims that its data judge."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..results import DEVICE_MODULES
from ..studies.style import save_figure, style_context

Data = dict[str, Any]
"""Arrays by name: what a figure computes, what it draws, and what is kept as .npz."""


class Quality(Enum):
    """How much is computed."""

    DRAFT = 'draft'
    """Small, in seconds: the same physics on coarser sweeps and fewer levels."""

    FULL = 'full'
    """Reading quality."""

    def pick(self, draft: Any, full: Any) -> Any:
        """Return the one of two values that belongs to this quality."""
        return draft if self is Quality.DRAFT else full


class Judgement(Enum):
    """What our simulation says of a sentence."""

    HOLDS = 'holds'
    REPLACED = 'with other numbers'
    """It holds once printed numbers are replaced."""
    IN_PART = 'in part'
    FAILS = 'fails'


class Judged(NamedTuple):
    """A judgement, and our numbers behind it in one or two sentences of Markdown."""

    judgement: Judgement
    numbers: str


def judge_numbers(
    holds: bool | np.bool_, numbers: str, *, in_part: bool | np.bool_ = False
) -> Judged:
    """Return HOLDS, or else IN_PART where something of it is true, or else FAILS."""
    if holds:
        return Judged(Judgement.HOLDS, numbers)
    return Judged(Judgement.IN_PART if in_part else Judgement.FAILS, numbers)


Judge = Callable[..., Judged]
Save = Callable[[Data, Path], list[Path]]


@dataclass(frozen=True)
class PaperClaim:
    """A checkable sentence of the paper.

    Attributes:
        where: Where on the page, if that can be told.
        how: How our number was obtained.
        printed: Where print and physics disagree, what is printed.
        replaced: By which numbers the printed ones had to be replaced.
        needs: Figures whose data the judge takes, in this order.
    """

    key: str
    sentence: str
    needs: tuple[str, ...]
    judge: Judge
    _: KW_ONLY
    page: int
    how: str
    where: str = ''
    printed: str = ''
    replaced: str = ''

    @property
    def place(self) -> str:
        """Where the paper has it, in words."""
        return f'p. {self.page}, {self.where}' if self.where else f'p. {self.page}'

    def judge_data(self, data: Mapping[str, Data]) -> Judged:
        """Judge the claim by the data of all figures, by name."""
        judgement, numbers = self.judge(*(data[name] for name in self.needs))
        if self.replaced and judgement is Judgement.HOLDS:
            judgement = Judgement.REPLACED
        return Judged(judgement, numbers)


@dataclass
class Figure:
    """One figure of the paper, or one of ours beside it.

    The file that makes it gives it its functions by the decorators `register_data` and
    `register_drawing`, and `register_claim` for every sentence that its data judge. A film has
    `register_film` instead; where only the claims matter there is neither.

    Attributes:
        name: What a person types, as '2a'.
        seconds: Rough cost at full quality: the long ones begin first.
        modules: What it measures or draws, beside its own file: paths of the checkout.
        ending: Of the picture on a page; empty if there is none.
    """

    name: str
    title: str
    seconds: float
    modules: tuple[str, ...] = DEVICE_MODULES
    claims: list[PaperClaim] = field(default_factory=list)
    draw: Callable[[Data], Any] | None = None
    ending: str = ''
    _save: Save = lambda data, stem: []

    def register_data(self, compute: Callable[[Quality], Data]) -> Callable[[Quality], Data]:
        """Take what computes the data, arrays or what becomes arrays."""

        @functools.wraps(compute)
        def compute_arrays(quality: Quality) -> Data:
            return {name: np.asarray(value) for name, value in compute(quality).items()}

        self.compute = compute_arrays
        return compute_arrays

    def register_drawing(self, draw: Callable[[Data], Any]) -> Callable[[Data], Any]:
        """Take what draws the data and returns a Matplotlib figure."""
        self._save = lambda data, stem: save_figure(draw(data), stem)
        self.draw, self.ending = draw, 'png'
        return draw

    def register_film(self, save: Save) -> Save:
        """Take what saves the data as a GIF of a stem, and returns the files."""
        self._save = save
        self.ending = 'gif'
        return save

    def register_claim(
        self, sentence: str, *, also: tuple[str, ...] = (), **source: Any
    ) -> Callable[[Judge], Judge]:
        """Return a decorator that takes the judge of a `PaperClaim`; its name is the key.

        The judge takes the data of this figure, then those of the figures in `also`. The `source`
        are the other attributes of the claim.
        """

        def keep_judge(judge: Judge) -> Judge:
            key, needs = judge.__name__.removeprefix('_'), (self.name, *also)
            self.claims.append(PaperClaim(key, sentence, needs, judge, **source))
            return judge

        return keep_judge

    @property
    def stem(self) -> str:
        """Name of its files without ending: that of the file that makes it."""
        return self.compute.__module__.rpartition('.')[2]

    def save(self, data: Data, folder: Path) -> list[Path]:
        """Write the data as .npz, and a drawing as .png and .svg or a film; return the files.

        The folder must exist.
        """
        stem = folder / self.stem
        np.savez_compressed(stem.with_suffix('.npz'), **data)
        with style_context():
            return [stem.with_suffix('.npz'), *self._save(data, stem)]


def load_data(path: Path) -> Data:
    """Return the data that `Figure.save` wrote."""
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}
