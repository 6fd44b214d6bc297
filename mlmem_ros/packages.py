# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What other packages add to this one, and how to install one that is missing."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points

TOOLS = 'mlmem_ros.tools'
"""Entry points of what a node or a robot's code asks of `mlmem_tools`, which imports us."""

DEBIAN = {
    'numpy': 'python3-numpy',
    'numba': 'python3-numba',
    'yaml': 'python3-yaml',
    'rich': 'python3-rich',
    'matplotlib': 'python3-matplotlib',
    'scipy': 'python3-scipy',
    'aiohttp': 'python3-aiohttp',
    'PIL': 'python3-pil',
}
"""Debian and Ubuntu packages, by import name."""

PYPI = {'yaml': 'pyyaml', 'PIL': 'pillow'}
"""PyPI names that differ from the import name."""

RECORDING = ('mcap', 'rosbags')
"""What recording and replay need beside PyYAML: on PyPI alone, the extra `bag`."""

ROS = (
    'rclpy', 'std_srvs', 'std_msgs', 'rcl_interfaces', 'sensor_msgs', 'diagnostic_msgs',
    'lifecycle_msgs', 'trajectory_msgs', 'visualization_msgs', 'geometry_msgs',
    'builtin_interfaces',
)  # fmt: skip
"""ROS 2 packages that the node or its clients use."""


def added(group: str) -> dict[str, EntryPoint]:
    """Return what is installed of a group of entry points, by name."""
    return {each.name: each for each in entry_points(group=group)}


def tool(name: str) -> EntryPoint:
    """Return a tool, not loaded yet.

    Raises:
        ModuleNotFoundError: Our distribution is not installed, or older than its files.
    """
    if (found := added(TOOLS).get(name)) is None:
        raise ModuleNotFoundError(
            f'{name} of mlmem_tools is not installed: install mlmem_ros again',
            name='mlmem_tools',
        )
    return found


def advice(name: str) -> str:
    """Return in one line how to install a package, given its import name."""
    if name in ROS:
        return (
            'source /opt/ros/jazzy/setup.bash, or install the wheels ros-jazzy-rclpy, '
            'ros-jazzy-common-interfaces and ros-jazzy-rmw-fastrtps-cpp'
        )
    pypi = ' '.join(RECORDING) if name in RECORDING else PYPI.get(name, name)
    if name in DEBIAN:
        return f'sudo apt install {DEBIAN[name]}, or in a virtual environment pip install {pypi}'
    return (
        f'python3 -m pip install {pypi} (where that is refused as externally managed: with '
        '--break-system-packages, or in a virtual environment)'
    )


def missing(error: ModuleNotFoundError) -> str:
    """Return in one line which package an import did not find, and how to install it."""
    name = (error.name or '').partition('.')[0]
    if name in ROS:
        return f'this needs ROS 2: {advice(name)}'
    if name == 'mlmem_tools':
        return f'{error}'
    if name == 'mlmem_lab':
        return 'the laboratory is missing; in a checkout: pip install ./lab'
    return f'the Python package {name} is missing: {advice(name)}'
