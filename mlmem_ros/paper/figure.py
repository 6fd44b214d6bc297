# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a study is: a module that computes arrays and draws them."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

Data = dict[str, Any]
"""Arrays by name: what a study computes, what it draws, and what is kept as .npz."""


class Quality(Enum):
    """How much is computed."""

    DRAFT = 'draft'
    """Small, in seconds: the same physics on coarser sweeps and fewer levels."""

    FULL = 'full'
    """Reading quality."""

    def pick(self, draft: Any, full: Any) -> Any:
        """Return the one of two values that belongs to this quality."""
        return draft if self is Quality.DRAFT else full


@dataclass(frozen=True)
class Study:
    """One figure of the paper, or one of ours beside it.

    Attributes:
        name: What a person types, as '2a'.
        module: The module below `mlmem_ros.paper.figures`. It has `compute(quality)`, which
            returns the data, and `draw(data)`, which returns a figure; a film has
            `save(data, stem)` instead, which returns the files it wrote.
        title: One line for a list.
        seconds: Rough cost at full quality: the long ones begin first.
    """

    name: str
    module: str
    title: str
    seconds: float

    @property
    def stem(self) -> str:
        """Name of the files without ending."""
        return self.module

    def load(self) -> ModuleType:
        """Import the module."""
        return importlib.import_module(f'.figures.{self.module}', __package__)

    def compute(self, quality: Quality) -> Data:
        """Return the study's data."""
        data: Data = self.load().compute(quality)
        return data

    def save(self, data: Data, folder: Path) -> list[Path]:
        """Write the data as .npz and the drawing as .png and .svg (or a film); return the files.

        Args:
            data: What `compute` returned.
            folder: Where to; it must exist.
        """
        from ..studies.style import save_figure, styled

        module = self.load()
        stem = folder / self.stem
        np.savez_compressed(stem.with_suffix('.npz'), allow_pickle=False, **data)
        saver: Callable[[Data, Path], list[Path]] | None = getattr(module, 'save', None)
        with styled():
            drawn = saver(data, stem) if saver else save_figure(module.draw(data), stem)
        return [stem.with_suffix('.npz'), *drawn]


def load_data(path: Path) -> Data:
    """Return the data that `Study.save` wrote."""
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}
