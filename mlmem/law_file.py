# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The file of an on-site law: `law.yaml`, as `mlmem law` writes it.

`{format: 1, unit: SI, law: {low: 0.0, high: 0.04, force: [...]}, force_std: [...]}`: a `Curve` in
m and N.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, dataclass, replace
from pathlib import Path

import numpy as np

from .atomic_files import write_atomically
from .parsing import DecodeError, decode_value, parse_yaml, read_file
from .physics import DesignError
from .physics.curve import Curve
from .schema import describe_field


class LawFileError(DecodeError):
    """A file is not a law; the message says why."""


@dataclass(frozen=True)
class _File:
    """The keys of a file."""

    format: int = describe_field(MISSING, 'version of the format', low=1, high=1)
    law: Curve = describe_field(MISSING, 'the curve of force')
    unit: str = describe_field('SI', 'SI: m and N', choices=('SI',))
    force_std: tuple[float | None, ...] = ()


def read_law_file(path: Path | str, length: float = 1.0, stiffness: float = 1.0) -> Curve:
    """Read a law, as a `Design` takes it: in units of a lattice constant and of a spring.

    Args:
        path: The file.
        length: Lattice constant, m.
        stiffness: Of the springs between cells, N/m.

    Raises:
        LawFileError: It cannot be read, or is none.
    """
    try:
        given: _File = decode_value(_File, parse_yaml(read_file(path)))
    except DecodeError as error:
        raise LawFileError.of_error(error, place=str(path)) from error
    law = given.law
    try:
        force = (np.array(law.force) / (stiffness * length)).tolist()
        return replace(law, low=law.low / length, high=law.high / length, force=tuple(force))
    except DesignError as error:
        place = f'{path}, in units of {length:g} m'
        raise LawFileError.of_error(error, 'law', place) from error


def write_law_file(path: Path, law: Curve, force_std: Sequence[float] = ()) -> None:
    """Write a law in SI units to a file, whole or not at all.

    Raises:
        OSError: It cannot be written; a file that was there is as it was.
    """
    import yaml  # type: ignore[import-untyped]

    curve = {'low': law.low, 'high': law.high, 'force': list(map(float, law.force))}
    if law.d != 1.0:
        curve['d'] = law.d
    values = {
        'format': 1, 'unit': 'SI', 'law': curve, 'force_std': list(force_std),
    }  # fmt: skip
    write_atomically(path, yaml.safe_dump(values, sort_keys=False, default_flow_style=None))
