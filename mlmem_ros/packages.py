# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Other packages: what they add to this one, their versions, and how to install one that is
missing.
"""

from __future__ import annotations

from importlib import metadata
from importlib.metadata import EntryPoint, entry_points


def find_entry_points(group: str) -> dict[str, EntryPoint]:
    """Return what is installed of a group of entry points, by name."""
    return {each.name: each for each in entry_points(group=group)}


def find_tool(name: str) -> EntryPoint:
    """Return a tool, not loaded yet.

    Raises:
        ModuleNotFoundError: Our distribution is not installed, or older than its files.
    """
    if (found := find_entry_points('mlmem_ros.tools').get(name)) is None:
        raise ModuleNotFoundError(
            f'{name} of mlmem_tools is not installed: install mlmem_ros again',
            name='mlmem_tools',
        )
    return found


def format_install_advice(name: str) -> str:
    """Return in one line how to install a package, given its import name."""
    if _is_ros_package(name):
        return (
            'source /opt/ros/jazzy/setup.bash, or install the wheels ros-jazzy-rclpy, '
            'ros-jazzy-common-interfaces and ros-jazzy-rmw-fastrtps-cpp'
        )
    known = {'yaml': 'pyyaml', 'PIL': 'pillow'}.get(name, name)  # PyPI's, where they differ
    return (
        f'python3 -m pip install {known} (where that is refused as '
        'externally managed: with --break-system-packages, or in a virtual environment)'
    )


def describe_missing(error: ModuleNotFoundError) -> str:
    """Return in one line which package an import did not find, and how to install it."""
    name = (error.name or '').partition('.')[0]
    if _is_ros_package(name):
        return f'this needs ROS 2: {format_install_advice(name)}'
    if name == 'mlmem_tools':
        return f'{error}'
    if name == 'mlmem_lab':
        return 'the laboratory is missing; in a checkout: pip install ./lab'
    return f'the Python package {name} is missing: {format_install_advice(name)}'


def _is_ros_package(name: str) -> bool:
    return name == 'rclpy' or name.endswith(('_msgs', '_srvs', '_interfaces'))


def find_installed_version(*packages: str) -> str:
    """Return the version of the first of some packages that is installed; empty without any."""
    for package in packages:
        try:
            return metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return ''
