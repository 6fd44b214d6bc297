# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shot in a CSV file, for a bench without ROS.

Lines `# name: value` give what `SHOT_HEADINGS` lists; the rows have v_1 and v_N, sample by
sample, empty or `nan` where there is none.
"""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

import numpy as np

from mlmem.instrument.end import End, Shot
from mlmem.parsing import DecodeError, read_file
from mlmem.schema import short_repr

SHOT_HEADINGS = ('end', 'omega_c', 'A', 'sigma', 'wall', 'strain', 'dt', 'rest_left', 'rest_right')
"""What describes a shot; units are lattice constants and time units of the instrument."""


def load_shot(path: Path) -> Shot:
    """Read a shot.

    Raises:
        DecodeError: The file cannot be read, or holds no shot.
    """
    try:
        lines = read_file(path).splitlines()
        pairs = (line[1:].split(':', 1) for line in lines if line[:1] == '#' and ':' in line)
        told = {name.strip(): value.strip() for name, value in pairs}
        if absent := [name for name in SHOT_HEADINGS if name not in told]:
            raise ValueError(f'it lacks {", ".join(absent)}')
        end = End(told['end'])
        omega_c, A, sigma, wall, strain, dt, left, right = (
            _parse_number(told[name], name) for name in SHOT_HEADINGS[1:]
        )
        if not dt > 0.0:
            raise ValueError(f'dt must be above 0; got {dt:g}')
        rows = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and line[:1] != '#']
        samples = np.array([_parse_row(line, k) for k, line in rows]).reshape(-1, 2).T.copy()
    except ValueError as error:
        raise DecodeError(
            f'{path} must be a shot with {", ".join(SHOT_HEADINGS)}: {error}'
        ) from error
    return Shot(end, omega_c, A, sigma, wall, strain, dt, np.array((left, right)), samples)


def _parse_row(line: str, number: int) -> list[float]:
    cells = line.split(',')
    if len(cells) != 2:
        raise ValueError(f'line {number}: it must have 2 values; got {len(cells)}')
    return [
        math.nan
        if cell.strip() in ('', 'nan')
        else _parse_number(cell, f'line {number}: a sample')
        for cell in cells
    ]


def _parse_number(text: str, name: str) -> float:
    with suppress(ValueError):
        if math.isfinite(value := float(text)):
            return value
    raise ValueError(f'{name} must be a finite number; got {short_repr(text)}')


def save_shot(path: Path, shot: Shot) -> None:
    """Write a shot.

    Raises:
        OSError: The file cannot be written.
    """
    values = (
        shot.end, shot.omega_c, shot.A, shot.sigma, shot.wall, shot.strain, shot.dt, *shot.rest
    )  # fmt: skip
    head = '\n'.join(f'{name}: {value}' for name, value in zip(SHOT_HEADINGS, values, strict=True))
    np.savetxt(path, shot.samples.T, delimiter=',', header=head, fmt='%.17g')
