# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shot in a CSV file, for a bench without ROS.

Lines `# name: value` give what `SHOT_HEADINGS` lists; the rows have v_1 and v_N, sample by
sample, empty or `nan` where there is none.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from mlmem import ErrorCode
from mlmem.instrument.end import End, Shot
from mlmem.parsing import DecodeError, read_file

from ..csv_rows import parse_number, read_rows

SHOT_HEADINGS = ('end', 'omega_c', 'A', 'sigma', 'wall', 'strain', 'dt', 'rest_left', 'rest_right')
"""What describes a shot; units are lattice constants and time units of the instrument."""


def load_shot(path: Path) -> Shot:
    """Read a shot.

    Raises:
        DecodeError: The file cannot be read, or holds no shot.
    """
    rows = [
        [math.nan if cell in ('', 'nan') else parse_number(cell, place) for cell in cells]
        for place, cells in read_rows(path)
    ]
    lines = (line[1:].split(':', 1) for line in read_file(path).splitlines() if line[:1] == '#')
    told = {name.strip(): value.strip() for name, *values in lines for value in values}
    absent = [name for name in SHOT_HEADINGS if name not in told]
    if absent or told['end'] not in list(End) or any(len(row) != 2 for row in rows):
        why = (
            f'it must be a shot with {", ".join(SHOT_HEADINGS)}, end one of '
            f'{", ".join(End)}, and rows of 2 values; it lacks {", ".join(absent) or "none"}'
        )
        raise DecodeError(ErrorCode.MISSING_FIELD, reason=why, place=str(path))
    omega_c, A, sigma, wall, strain, dt, left, right = (
        parse_number(told[name], str(path), name) for name in SHOT_HEADINGS[1:]
    )
    if not dt > 0.0:
        raise DecodeError(ErrorCode.OUT_OF_RANGE, 'dt', dt, 'above 0', place=str(path))
    samples = np.array(rows).reshape(-1, 2).T.copy()
    return Shot(
        End(told['end']), omega_c, A, sigma, wall, strain, dt, np.array((left, right)), samples
    )
