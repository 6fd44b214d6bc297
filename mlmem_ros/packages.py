# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Other packages: what they add to this one, how to install one that is missing, and the private
names of libraries that we use, with the versions in which they are known.

A private name may move with any release. So each is listed here, looked for when its library is
first used, and missed in one clear line.
"""

from __future__ import annotations

import functools
import re
import sys
from importlib import import_module, metadata
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any, NamedTuple

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


@functools.cache
def entries() -> EntryPoints:
    """Return all entry points; to find them, every installed package is looked into."""
    return entry_points()


def added(group: str) -> dict[str, EntryPoint]:
    """Return what is installed of a group of entry points, by name."""
    return {each.name: each for each in entries().select(group=group)}


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


class Library(NamedTuple):
    """A library of which we use private names.

    Attributes:
        packages: Names under which it is installed.
        oldest: Oldest version tested.
        newest: Newest, as far as given: 7.1 stands for every 7.1.x.
        private: Names inside it, as `module:Name.attribute`: methods, or attributes of instances.
        optional: Modules that not every user of the library loads.
    """

    packages: tuple[str, ...]
    oldest: str
    newest: str
    private: tuple[str, ...]
    optional: tuple[str, ...] = ()


_CORE = 'rclpy.impl.implementation_singleton:rclpy_implementation'

LIBRARIES = {
    'numba': Library(
        ('numba',),
        '0.58',
        '0.68',
        (
            'numba.core.dispatcher:Dispatcher._cache',  # cached loops know their formulas
            'numba.core.caching:FunctionCache._index_key',
            'numba.core.caching:Cache._cache_file',  # is a loop compiled already?
            'numba.core.caching:IndexDataCacheFile._load_index',
        ),
    ),
    'rclpy': Library(
        ('ros-jazzy-rclpy', 'ros-kilted-rclpy', 'rclpy'),
        '7.1.4',  # Jazzy
        '9.1',  # Kilted
        (
            f'{_CORE}.EventsExecutor',  # an executor without a fault handler
            f'{_CORE}.RCLError',  # errors of its own services are answered
            f'{_CORE}.Service.service_take_request',  # requests after a broken one
            f'{_CORE}.rmw_service_info_t',  # who has sent a request
            f'{_CORE}.rclpy_logging_rcutils_log',  # a line without a search for who wrote it
            'rclpy.service:Service.handle',
            'rclpy.service:Service.send_response',  # responses are sent by coroutines
            'rclpy.node:Node._parameter_overrides',  # which parameters were given
            'rclpy.lifecycle.node:LifecycleNodeMixin._state_machine',  # it leaves at once
        ),
        ('rclpy.lifecycle.node',),
    ),
}
"""All of them, by the name under which the library is imported."""


def version(library: str) -> str:
    """Return the installed version of a library; empty if it is not known."""
    return installed(*LIBRARIES[library].packages)


def installed(*packages: str) -> str:
    """Return the version of the first of some packages that is installed; empty without any."""
    for package in packages:
        try:
            return metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return ''


def tested(library: str) -> bool:
    """Return whether the installed version of a library is among those tested."""
    found, known = version(library), LIBRARIES[library]
    newest = _numbers(known.newest)
    return _numbers(known.oldest) <= _numbers(found) and _numbers(found)[: len(newest)] <= newest


def look(library: str) -> None:
    """Look for the private names of a library that we use.

    Raises:
        ImportError: One is not there.
    """
    known = LIBRARIES[library]
    unused = {*known.optional} - {*sys.modules}
    used = (each for each in known.private if each.partition(':')[0] not in unused)
    if missing := [each.replace(':', '.') for each in used if not is_there(each)]:
        raise ImportError(
            f'{library} {version(library)} lacks {", ".join(missing)}; mlmem_ros is tested with '
            f'{library} {known.oldest} to {known.newest}: install one of these',
            name=library,
        )


def is_there(place: str) -> bool:
    """Return whether there is a name, written as `module:Name.attribute`."""
    home, _, name = place.partition(':')
    try:
        found: Any = import_module(home)
    except ImportError:
        return False
    *above, last = name.split('.')
    for part in above:
        found = getattr(found, part, None)
    if hasattr(found, last) or last in getattr(found, '__annotations__', ()):
        return True
    family = found.__mro__ if isinstance(found, type) else (found or object,)
    members = (each for one in family for each in vars(one).values())
    codes = (getattr(each, '__code__', None) for each in members)
    return any(last in code.co_names for code in codes if code is not None)


def _numbers(version: str) -> tuple[int, ...]:
    """Return a version for comparison, without what is no number."""
    found = re.match(r'\d+(\.\d+)*', version)
    return tuple(map(int, found[0].split('.'))) if found else ()
