# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The machine and the versions that a measurement belongs to."""

from __future__ import annotations

import os
import platform
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
