# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A shot in a CSV file, for a bench without ROS.

Lines `# name: value` give what `HEAD` lists; the rows have v_1 and v_N, sample by sample, empty or
`nan` where there is none.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mlmem_ros.clipped import printable
from mlmem_ros.device.end import End, Shot
from mlmem_ros.outside import LONGEST, DecodeError, read

from .fit import Misfitting

HEAD = ('end', 'omega_c', 'A', 'sigma', 'wall', 'strain', 'dt', 'rest_left', 'rest_right')
"""What describes a shot; units are lattice constants and time units of the instrument."""


def load(path: Path) -> Shot:
    """Read a shot.

    Raises:
        Misfitting: The file cannot be read, or holds no shot.
    """
    try:
        lines = read(path).splitlines()
        head = dict(
            line[1:].strip().split(':', 1)
            for line in lines
            if line.startswith('#') and ':' in line
        )
        told = {name.strip(): value.strip() for name, value in head.items()}
        end = End(told.pop('end'))
        omega_c, A, sigma, wall, strain, dt, left, right = (
            float(told[name]) for name in HEAD if name != 'end'
        )
        rows = [line for line in lines if line.strip() and not line.startswith('#')]
        samples = np.ascontiguousarray(np.genfromtxt(rows, delimiter=',', ndmin=2).T)
        if samples.shape[0] != 2 or not dt > 0.0:
            raise ValueError(f'two columns and a dt above 0 are needed; got {samples.shape[0]}')
    except (KeyError, ValueError) as error:
        why = printable(str(error) if isinstance(error, DecodeError) else repr(error), LONGEST)
        name = printable(str(path), LONGEST)
        raise Misfitting(f'{name} must be a shot with {", ".join(HEAD)}: {why}') from error
    return Shot(end, omega_c, A, sigma, wall, strain, dt, np.array((left, right)), samples)


def save(path: Path, shot: Shot) -> None:
    """Write a shot.

    Raises:
        OSError: The file cannot be written.
    """
    values = (
        shot.end, shot.omega_c, shot.A, shot.sigma, shot.wall, shot.strain, shot.dt, *shot.rest
    )  # fmt: skip
    head = '\n'.join(f'{name}: {value}' for name, value in zip(HEAD, values, strict=True))
    np.savetxt(path, shot.samples.T, delimiter=',', header=head, fmt='%.17g')
