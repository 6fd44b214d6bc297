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
from dataclasses import dataclass

from mlmem_ros import __version__, packages

from .command import JSON_OPTION, declare_command, declare_option
from .output import print_json

OPTIONAL_LIBRARIES = 'mcap', 'rosbags', 'rich'
"""Recording, replay and most commands need these; without the others no node starts."""


@dataclass(frozen=True)
class Diagnosis:
    """What a check found, and what to do; empty if nothing is needed."""

    what: str
    verdict: str
    seen: str
    advice: str = ''


@declare_command(
    'check whether this machine has what a memory needs',
    declare_option('--warm', action='store_true', help='first compile the kernels, for nodes'),
    JSON_OPTION,
    text=__doc__,
)
def doctor(arguments: argparse.Namespace) -> int:
    """Check everything and print a table; return the exit status."""
    stream = sys.stderr if arguments.json else sys.stdout
    print(f'mlmem_ros {__version__}', file=stream)
    if arguments.warm:
        from mlmem import ELEMENT_NAMES, load_element
        from mlmem_ros.host.design_check import load_findings

        for shipped in map(load_element, ELEMENT_NAMES):  # as a first start does, which compiles
            load_findings(*shipped.design_and_settings)
    for each in (found := examine_machine()):
        advice = f'\n{"":25} -> {each.advice}' if each.advice else ''
        print(f'{each.verdict}  {each.what:<18} {each.seen}{advice}', file=stream)
    if arguments.json:
        print_json({'version': __version__, 'findings': found})
    return 1 if any(each.verdict == 'fail' for each in found) else 0


def examine_machine() -> list[Diagnosis]:
    """Check everything, item by item."""
    needed = [check_library(name) for name in ('numpy', 'numba', 'yaml')]
    found = [*needed, *map(check_library, ('rclpy', *OPTIONAL_LIBRARIES))]
    if all(each.verdict != 'fail' for each in needed):
        found += [check_compile_cache(), check_speed()]
    return [*found, check_domain(os.environ.get('ROS_DOMAIN_ID', ''))]


def check_library(name: str) -> Diagnosis:
    """Check whether a Python package can be imported, and find its version."""
    try:
        importlib.import_module(name)
    except Exception as error:  # a broken installation may raise anything
        verdict = 'warn' if name in OPTIONAL_LIBRARIES else 'fail'
        return Diagnosis(name, verdict, str(error), packages.format_install_advice(name))
    wheels = ('ros-jazzy-rclpy', 'ros-kilted-rclpy') if name == 'rclpy' else ()
    return Diagnosis(name, 'pass', packages.find_installed_version(*wheels, name))


def check_compile_cache() -> Diagnosis:
    """Check whether compiled kernels can be cached."""
    from mlmem.physics import find_cache_folder
    from mlmem.physics.jit import check_cache_space

    folder = find_cache_folder()
    try:
        if folder is None:
            raise PermissionError('no folder can be written')
        check_cache_space(folder)
    except OSError as error:
        advice = 'set NUMBA_CACHE_DIR to a folder with free space, or every start compiles'
        return Diagnosis('compiled kernels', 'warn', str(error), advice)
    return Diagnosis('compiled kernels', 'pass', f'kept in {folder}')


def check_speed() -> Diagnosis:
    """Run an element that is written for a second of its own time."""
    from mlmem import MemoryElement, Write, load_element

    element = MemoryElement(load_element('case_2'))
    element.apply(Write(3))
    element.advance()  # compiles
    begun = time.monotonic()
    element.advance(round(1.0 / element.settings.tick_seconds))
    if (taken := time.monotonic() - begun) < 1.0:
        return Diagnosis('speed', 'pass', f'{1.0 / taken:.0f} times real time')
    advice = 'use a processor of 2013 or later; in a virtual machine the CPU model host'
    return Diagnosis('speed', 'warn', f'a second of the element takes {taken:.1f} s', advice)


def check_domain(number: str) -> Diagnosis:
    """Check ROS_DOMAIN_ID: nodes of another domain are invisible."""
    if not number:
        return Diagnosis('ROS_DOMAIN_ID', 'warn', 'not set: 0', 'give your robot its own number')
    if number.isdecimal() and int(number) <= 101:  # Linux uses the ports of greater ones
        return Diagnosis('ROS_DOMAIN_ID', 'pass', number)
    return Diagnosis('ROS_DOMAIN_ID', 'fail', number, 'set a number from 0 to 101')
