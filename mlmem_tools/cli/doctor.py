# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem doctor`: check whether this machine has what a memory needs, and say what to do.

Exit status 0: nothing failed (warnings do not count); 1: something did.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from mlmem_ros import __version__, packages

from .command import JSON_OPTION, declare_command, declare_option
from .output import print_json

LIBRARY_USES = {
    'numpy': '', 'numba': '', 'yaml': '', 'mcap': 'recording and replay',
    'rosbags': 'recording and replay', 'rich': 'most commands',
}  # fmt: skip
"""Python packages, and what needs them; without those that are empty here no node starts."""

MAX_SAFE_DOMAIN = 101
"""Greatest ROS_DOMAIN_ID whose ports Linux does not use."""


@dataclass(frozen=True)
class Diagnosis:
    """What a check found, and what to do; empty if nothing is needed."""

    what: str
    verdict: Literal['pass', 'warn', 'fail']
    seen: str
    advice: str = ''


@declare_command(
    'check whether this machine has what a memory needs',
    declare_option(
        '--warm',
        action='store_true',
        help='first compile the kernels and check the elements, so that a node starts in a second',
    ),
    JSON_OPTION,
    text=__doc__,
)
def doctor(arguments: argparse.Namespace) -> int:
    """Check everything and print a table; return the exit status."""
    stream = sys.stderr if arguments.json else sys.stdout
    print(f'mlmem_ros {__version__}', file=stream)
    if arguments.warm:
        for name in warm_caches():
            print(f'warm  {name}', flush=True, file=stream)
    found = []
    for each in examine_machine():
        advice = f'\n{"":25} -> {each.advice}' if each.advice else ''
        print(f'{each.verdict}  {each.what:<18} {each.seen}{advice}', flush=True, file=stream)
        found.append(each)
    failed, warned = (sum(each.verdict == kind for each in found) for kind in ('fail', 'warn'))
    print(f'{len(found)} checks: {failed} failed, {warned} with a warning', file=stream)
    if arguments.json:
        print_json({'version': __version__, 'findings': found})
    return 1 if failed else 0


def warm_caches() -> Iterator[str]:
    """Compile the kernels and check the elements, as a first start does; yield their names."""
    from mlmem import ELEMENT_NAMES, load_element
    from mlmem.physics import CASE_II, INTEGRATORS, Chain
    from mlmem_ros.host.design_check import load_findings

    for name, integrator in INTEGRATORS.items():
        for substrate in ('rigid', 'elastic'):
            Chain(replace(CASE_II, substrate=substrate), integrator=integrator).rest(1)
            yield f'kernel {name}, {substrate} substrate'
    for name in ELEMENT_NAMES:
        load_findings(*load_element(name).design_and_settings)
        yield f'design check of {name}'


def examine_machine() -> Iterator[Diagnosis]:
    """Check everything, item by item."""
    yield check_python(sys.version_info[:2])
    libraries = [check_library(name) for name in LIBRARY_USES]
    yield from libraries
    if all(library.verdict != 'fail' for library in libraries):
        yield check_compile_cache()
        yield check_speed()
    yield check_ros()
    yield check_domain(os.environ.get('ROS_DOMAIN_ID'))


def check_python(version: tuple[int, ...]) -> Diagnosis:
    """Check the version of Python."""
    seen = '.'.join(map(str, version))
    if (3, 10) <= version <= (3, 14):
        return Diagnosis('Python', 'pass', seen)
    return Diagnosis('Python', 'warn' if version > (3, 14) else 'fail', seen, 'use 3.10 to 3.14')


def check_library(name: str) -> Diagnosis:
    """Check whether a Python package can be imported, and its version."""
    try:
        module = importlib.import_module(name)
    except Exception as error:  # a broken installation may raise anything
        use = LIBRARY_USES.get(name)
        seen = f'{error}: no {use}' if use else str(error)
        advice = packages.format_install_advice(name)
        return Diagnosis(name, 'warn' if use else 'fail', seen, advice)
    return _judge_version(name, getattr(module, '__version__', ''))


def _judge_version(name: str, version: str) -> Diagnosis:
    """Return a warning for a library whose private names we use, if its version is not tested."""
    seen = version or packages.find_installed_version(name) or 'of unknown version'
    if name in packages.TESTED_LIBRARIES and not packages.is_version_tested(name):
        known = packages.TESTED_LIBRARIES[name]
        return Diagnosis(name, 'warn', seen, f'tested with {known.oldest} to {known.newest}')
    return Diagnosis(name, 'pass', seen)


def check_compile_cache() -> Diagnosis:
    """Check whether compiled kernels can be cached, and whether those cached can be loaded."""
    from mlmem.physics import NOH_BATHE
    from mlmem.physics.jit import check_cache_space, find_cache_folder

    what = 'compiled kernels'
    folder = find_cache_folder(NOH_BATHE.advance)
    try:
        if folder is None:
            raise PermissionError('no folder can be written')
        check_cache_space(folder)
    except OSError as error:
        seen = f'cannot be cached ({error}): every start takes some seconds longer'
        return Diagnosis(what, 'warn', seen, 'set NUMBA_CACHE_DIR to a folder with free space')
    return Diagnosis(what, 'pass', f'kept in {folder}')


def check_speed() -> Diagnosis:
    """Run an element that is written for a second of its own time."""
    from mlmem import MemoryElement, Write, load_element

    element = MemoryElement(load_element('case_2'))
    element.apply(Write(3))
    element.advance()  # compiles
    begun = time.monotonic()
    element.advance(round(1.0 / element.settings.tick_seconds))
    taken = time.monotonic() - begun
    if taken < 1.0:
        return Diagnosis('speed', 'pass', f'{1.0 / taken:.0f} times real time')
    advice = 'use a processor with fused multiply-add (2013 or later; CPU model of a VM: host)'
    return Diagnosis('speed', 'warn', f'a second of the element takes {taken:.1f} s', advice)


def check_ros() -> Diagnosis:
    """Check for rclpy, its middleware and the message packages."""
    try:
        for package in ('rclpy', 'std_msgs', 'sensor_msgs', 'diagnostic_msgs', 'rcl_interfaces'):
            importlib.import_module(package)
        from rclpy.utilities import get_rmw_implementation_identifier

        middleware = get_rmw_implementation_identifier()
    except Exception as error:  # the middleware is loaded here and may raise anything
        advice = packages.format_install_advice('rclpy')
        return Diagnosis('ROS 2', 'fail', str(error), advice)
    found = _judge_version('rclpy', packages.find_library_version('rclpy'))
    return replace(found, what='ROS 2', seen=f'rclpy {found.seen}, {middleware}')


def check_domain(value: str | None) -> Diagnosis:
    """Check ROS_DOMAIN_ID: nodes of another domain are invisible."""
    what = 'ROS_DOMAIN_ID'
    if not value:
        if os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') in ('LOCALHOST', 'OFF'):
            return Diagnosis(what, 'pass', 'not set: 0, on this machine only')
        seen = 'not set: 0, shared with everybody on this network'
        return Diagnosis(what, 'warn', seen, 'give your robot its own number')
    if not value.isdecimal() or int(value) > MAX_SAFE_DOMAIN:
        return Diagnosis(what, 'fail', value, f'set a number from 0 to {MAX_SAFE_DOMAIN}')
    return Diagnosis(what, 'pass', value)
