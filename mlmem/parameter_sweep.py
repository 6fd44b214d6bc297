# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measure a design over a grid of its parameters and over scattered elements."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import ErrorCode, SettingsError
from .physics import Design, Material, Scatter, Specimen, as_design, draw_specimen
from .progress import track_progress

Measurement = Callable[[Specimen], 'float | Mapping[str, Any]']
"""What is measured of an element: a number, or several by name."""


@dataclass(frozen=True)
class Table:
    """Rows of equal columns: what a sweep returns.

    Attributes:
        columns: Names of the columns.
        rows: One mapping per element, in the order of the grid; the seed changes fastest.
    """

    columns: tuple[str, ...]
    rows: tuple[Mapping[str, Any], ...]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        return iter(self.rows)

    def __getitem__(self, column: str) -> NDArray[Any]:
        """Return a column, shape (rows,)."""
        return np.array([row[column] for row in self.rows])

    def save(self, path: Path | str) -> Path:
        """Write it as CSV.

        Raises:
            OSError: It cannot be written.
        """
        path = Path(path)
        with path.open('w', newline='', encoding='utf-8') as file:
            writer = csv.DictWriter(file, self.columns)
            writer.writeheader()
            writer.writerows(self.rows)
        return path

    def to_pandas(self) -> Any:
        """Return a pandas DataFrame.

        Raises:
            ModuleNotFoundError: pandas is not installed.
        """
        import pandas

        return pandas.DataFrame(list(self.rows), columns=list(self.columns))

    def __str__(self) -> str:
        cells = [list(self.columns)]
        cells += [[_format_cell(row[name]) for name in self.columns] for row in self.rows]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        lines = ('  '.join(f'{c:>{w}}' for c, w in zip(row, widths, strict=True)) for row in cells)
        return '\n'.join(lines)


def _format_cell(value: Any) -> str:
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def sweep(
    material: Material,
    *,
    measure: Measurement,
    seeds: Iterable[int] = (0,),
    executor: Executor | None = None,
    progress: bool = True,
    **axes: Sequence[Any] | NDArray[Any],
) -> Table:
    """Measure every combination of parameters and seeds.

    Args:
        material: A design, or what has one; the axes change it.
        measure: Called with every element; in other processes if the executor has these, so it
            must be importable there.
        seeds: Of the scattered elements; the same seed gives the same element.
        executor: Any `concurrent.futures` executor, such as a `ProcessPoolExecutor` or Dask's
            `Client.get_executor()`; by default the calls follow each other in this process.
        progress: Whether to show a progress bar if it takes longer than two seconds.
        axes: Values by the name of a field of `Design` (`eta=[0.002, 0.004]`), or of a scatter:
            `alpha_std`, `k_r_std`, `s_std`, `mass_std`, `offset_std`,
            `depth_std`.

    Raises:
        SettingsError: An axis is neither, or no list of values, or has the name of a measurement.
        DesignError: A value is out of range.
    """
    design = as_design(material)
    of_design = {field.name for field in fields(Design)}
    of_scatter = [f'{field.name}_std' for field in fields(Scatter)]
    for name, values in axes.items():
        if name not in of_design and name not in of_scatter:
            known = ', '.join([*sorted(of_design), *of_scatter])
            raise SettingsError.out_of_range('axis', name, f'one of {known}')
        if isinstance(values, str) or not np.iterable(values) or not len(values):
            raise SettingsError.out_of_range(name, values, 'a list of one value or more')
        if isinstance(values, np.ndarray):  # a design takes no integer of NumPy
            axes[name] = values.tolist()
    if not np.iterable(seeds) or not (seeds := tuple(seeds)):
        raise SettingsError.out_of_range('seeds', seeds, 'a list of one seed or more')
    points = [
        dict(zip((*axes, 'seed'), values, strict=True))
        for values in itertools.product(*axes.values(), seeds)
    ]
    elements = [_make_element(design, point) for point in points]  # Dask maps no iterator
    found = (map if executor is None else executor.map)(measure, elements)
    if progress:
        found = track_progress(found, len(points), 'sweeping')
    rows = [_build_row(point, values) for point, values in zip(points, found, strict=True)]
    return Table(tuple(rows[0]), tuple(rows))


def _make_element(design: Design, point: Mapping[str, Any]) -> Specimen:
    """Return the element of a point of the grid."""
    values = dict(point)
    seed = values.pop('seed')
    deviations = {
        field.name: values.pop(f'{field.name}_std', field.default) for field in fields(Scatter)
    }
    return draw_specimen(replace(design, **values), Scatter(**deviations), seed)


def _build_row(point: Mapping[str, Any], measured: Any) -> dict[str, Any]:
    """Return a point of the grid with its measurement: by its own names, or a number as `value`.

    Raises:
        SettingsError: A name of the measurement is one of the point.
    """
    named = measured if isinstance(measured, Mapping) else {'value': measured}
    if taken := sorted(point.keys() & named.keys()):
        expected = 'of other names than the axes and the seed'
        raise SettingsError(ErrorCode.CONFLICT, 'measure', taken, expected)
    return {**point, **named}
