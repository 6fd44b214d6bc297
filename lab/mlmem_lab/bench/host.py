# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The machine and the versions that a measurement belongs to, and how busy it is otherwise."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGES = (
    'mlmem_ros', 'numpy', 'numba', 'llvmlite', 'scipy', 'heyoka', 'jax', 'diffrax',
    'mujoco', 'mcap', 'rosbags', 'rclpy',
)  # fmt: skip


def describe_host() -> dict[str, Any]:
    """Return processor, vector units, cores, load and versions."""
    return {
        'processor': _processor(),
        'vector_units': [unit for unit in ('avx2', 'fma', 'avx512f') if unit in _cpu('flags')],
        'cores': os.cpu_count(),
        'load': os.getloadavg()[0],
        'system': platform.platform(),
        'python': platform.python_version(),
        'versions': {name: version for name in PACKAGES if (version := _version(name))},
    }


def _processor() -> str:
    """Return name, family and model: virtual machines hide the number in the name."""
    return f'{_cpu("model name")} (family {_cpu("cpu family")}, model {_cpu("model")})'


def _cpu(key: str) -> str:
    """Return a line of the first core's description; empty if there is none."""
    lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    pairs = (line.partition(':') for line in lines)
    return next((value.strip() for name, _, value in pairs if name.strip() == key), '')


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ''


QUIET = 10.0
"""Share of a core, in percent, that others may take on a quiet machine."""

HERTZ = os.sysconf('SC_CLK_TCK')

IDLE = (3, 4)
"""Columns of /proc/stat in which no work is done: idle and iowait."""


class Load:
    """Measures from its start which share of a core others use.

    That is the time which has passed on all cores, less what they were idle, less our own. The
    kernel measures idle time and that of a process, but samples the other columns of /proc/stat
    at its ticks, at which work that a timer starts is always found.
    """

    def __init__(self, processes: Iterable[int] = ()) -> None:
        """Begin to measure; processes of ours beside this one, by id, must live on."""
        self._ours = [os.getpid(), *processes]
        self._begun = time.monotonic(), self._known()

    def others(self) -> float:
        """Return the share of others since the start, in percent of a core."""
        when, known = self._begun
        seconds = time.monotonic() - when
        return max(0.0, 100.0 * (_cores() - (self._known() - known) / seconds))

    def _known(self) -> float:
        """Return the seconds, summed over cores, that were idle or ours."""
        idle = sum(int(_lines()[0].split()[1:][column]) for column in IDLE)
        return idle / HERTZ + sum(map(used, self._ours))


def _lines() -> list[str]:
    """Return the lines of all cores together, and of each, from /proc/stat."""
    lines = Path('/proc/stat').read_text(encoding='ascii').splitlines()
    return [line for line in lines if line.startswith('cpu')]


def _cores() -> int:
    return len(_lines()) - 1


def used(process: int) -> float:
    """Return the seconds that a process has used, in its code and the system's."""
    fields = Path(f'/proc/{process}/stat').read_text(encoding='utf-8').rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / HERTZ
