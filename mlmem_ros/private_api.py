# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The private doors of libraries that we go through, and the versions in which they are known.

A private name may move with any release. So each is listed here, looked for when its library is
first used, and missed in one clear line.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module, metadata
from typing import Any, NamedTuple


class Library(NamedTuple):
    """A library with private doors.

    Attributes:
        packages: Names under which it is installed.
        oldest: Oldest version tested.
        newest: Newest, as far as given: 7.1 stands for every 7.1.x.
        doors: Names inside it, as `module:Name.attribute`: methods, or attributes of instances.
        optional: Modules that not every user of the library loads.
    """

    packages: tuple[str, ...]
    oldest: str
    newest: str
    doors: tuple[str, ...]
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
        ('ros-jazzy-rclpy', 'rclpy'),
        '7.1.4',
        '7.1',
        (
            f'{_CORE}.EventsExecutor',  # an executor without a fault handler
            f'{_CORE}.RCLError',  # errors of its own services are answered
            f'{_CORE}.Service.service_take_request',  # requests after a broken one
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
    """Look for the doors of a library.

    Raises:
        ImportError: One is not there.
    """
    known = LIBRARIES[library]
    unused = {*known.optional} - {*sys.modules}
    used = (door for door in known.doors if door.partition(':')[0] not in unused)
    if missing := [door.replace(':', '.') for door in used if not is_there(door)]:
        raise ImportError(
            f'{library} {version(library)} lacks {", ".join(missing)}; mlmem_ros is tested with '
            f'{library} {known.oldest} to {known.newest}: install one of these',
            name=library,
        )


def is_there(door: str) -> bool:
    """Return whether a library has a door."""
    home, _, name = door.partition(':')
    try:
        found: Any = import_module(home)
    except ImportError:
        return False
    *above, last = name.split('.')
    for part in above:
        found = getattr(found, part, None)
    if hasattr(found, last) or last in getattr(found, '__annotations__', ()):
        return True
    codes = (getattr(each, '__code__', None) for each in vars(found or object).values())
    return any(last in code.co_names for code in codes if code is not None)


def _numbers(version: str) -> tuple[int, ...]:
    """Return a version for comparison, without what is no number."""
    found = re.match(r'\d+(\.\d+)*', version)
    return tuple(map(int, found[0].split('.'))) if found else ()
