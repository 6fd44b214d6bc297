# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a machine needs, checked item by item; each check reports what it found, with advice."""

from __future__ import annotations

import errno
import importlib
import os
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from mlmem_ros import packages
from mlmem_ros.host.design_check import Verdict
from mlmem_ros.packages import format_install_advice

PASS, WARN, FAIL = Verdict.PASS, Verdict.WARN, Verdict.FAIL


LIBRARY_USES = {
    'numpy': '',
    'numba': '',
    'yaml': '',
    'mcap': 'recording and replay',
    'rosbags': 'recording and replay',
    'rich': 'most commands',
}
"""Python packages, and what needs them; without those that are empty here no node starts."""


@dataclass(frozen=True)
class Diagnosis:
    """What a check found.

    Attributes:
        advice: What to do; empty if nothing is needed.
    """

    what: str
    verdict: Verdict
    seen: str
    advice: str = ''


def examine_machine(node: str, wait: float, records: Path) -> Iterator[Diagnosis]:
    """Check everything, item by item.

    Args:
        node: Name of a memory node that may be running.
        wait: How long to wait for it, in seconds.
        records: Where sessions will be recorded.
    """
    yield check_python(sys.version_info[:2])
    libraries = [check_library(name) for name in LIBRARY_USES]
    yield from libraries
    if not any(library.verdict is FAIL for library in libraries):
        yield check_compile_cache()
        yield check_processor()
    ros = check_ros()
    yield ros
    yield check_domain(os.environ.get('ROS_DOMAIN_ID'))
    yield check_log_folder(find_log_folder())
    yield check_disk(records)
    if ros.verdict is not FAIL:
        yield check_node(node, wait)


def check_python(version: tuple[int, ...]) -> Diagnosis:
    """Check the version of Python."""
    tested_pythons = ((3, 10), (3, 14))  # oldest and newest tested Python
    seen, oldest, newest = ('.'.join(map(str, each)) for each in (version, *tested_pythons))
    if tested_pythons[0] <= version <= tested_pythons[1]:
        return Diagnosis('Python', PASS, seen)
    verdict = FAIL if version < tested_pythons[0] else WARN
    return Diagnosis('Python', verdict, seen, f'use Python {oldest} to {newest}')


def check_library(name: str) -> Diagnosis:
    """Check whether a Python package can be imported."""
    try:
        module = importlib.import_module(name)
    except Exception as error:  # a broken installation may raise anything
        use = LIBRARY_USES.get(name)
        seen = f'{error}: no {use}' if use else str(error)
        return Diagnosis(name, WARN if use else FAIL, seen, format_install_advice(name))
    seen = getattr(module, '__version__', '') or _find_version(name)
    return _warn_untested(Diagnosis(name, PASS, seen), name)


def _warn_untested(found: Diagnosis, library: str) -> Diagnosis:
    """Return what was found of a library, with a warning if this version is not tested."""
    if library not in packages.TESTED_LIBRARIES or packages.is_version_tested(library):
        return found
    known = packages.TESTED_LIBRARIES[library]
    return replace(
        found, verdict=WARN, advice=f'tested with {library} {known.oldest} to {known.newest}'
    )


def check_compile_cache() -> Diagnosis:
    """Check whether compiled kernels can be cached."""
    from mlmem.physics import NOH_BATHE
    from mlmem.physics.jit import check_cache_space, find_cache_folder

    what = 'compiled kernels'
    folder = find_cache_folder(NOH_BATHE.advance)
    try:
        if folder is None:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        check_cache_space(folder)
    except OSError as error:
        seen = f'cannot be cached ({error.strerror}): every start takes some seconds longer'
        return Diagnosis(
            what,
            WARN,
            seen,
            'set NUMBA_CACHE_DIR to a writable folder with some megabytes of free space',
        )
    return Diagnosis(what, PASS, f'kept in {folder}')


def check_processor() -> Diagnosis:
    """Check whether the processor has the instruction that makes the kernels fast."""
    from mlmem.physics.jit import has_fma

    if has_fma():
        return Diagnosis('processor', PASS, 'multiplies and adds in one instruction')
    seen = 'has no fused multiply-add: same results, a hundred times slower, not in real time'
    return Diagnosis(
        'processor',
        WARN,
        seen,
        'use one from 2013 or later; a virtual machine must expose it (CPU model: host)',
    )


def check_ros() -> Diagnosis:
    """Check for rclpy, its middleware and the message packages."""
    try:
        for package in (
            'rclpy',
            'std_msgs',
            'std_srvs',
            'sensor_msgs',
            'diagnostic_msgs',
            'rcl_interfaces',
        ):
            importlib.import_module(package)
        from rclpy.utilities import get_rmw_implementation_identifier

        middleware = get_rmw_implementation_identifier()
    except Exception as error:  # the middleware is loaded here and may raise anything
        return Diagnosis(
            'ROS 2',
            FAIL,
            str(error),
            'source /opt/ros/jazzy/setup.bash, or install the wheels: make setup',
        )
    distribution = os.environ.get('ROS_DISTRO', 'jazzy')
    if distribution != 'jazzy':
        return Diagnosis('ROS 2', WARN, f'{distribution}, {middleware}', 'only Jazzy is tested')
    return _warn_untested(
        Diagnosis('ROS 2', PASS, f'rclpy {_find_version("rclpy")}, {middleware}'), 'rclpy'
    )


def check_domain(value: str | None) -> Diagnosis:
    """Check ROS_DOMAIN_ID: nodes of another domain are invisible."""
    what = 'ROS_DOMAIN_ID'
    if not value:
        if os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') in ('LOCALHOST', 'OFF'):
            return Diagnosis(what, PASS, 'not set: 0, on this machine only')
        seen = 'not set: 0, shared with everybody on this network'
        return Diagnosis(what, WARN, seen, 'give your robot its own number')
    max_safe_domain = 101  # greatest one whose ports Linux does not use
    if not value.isdecimal() or int(value) > 232:  # above it DDS has no ports left
        return Diagnosis(what, FAIL, value, f'set a number from 0 to {max_safe_domain}')
    if int(value) > max_safe_domain:
        advice = f'above {max_safe_domain} Linux may use its ports for something else'
        return Diagnosis(what, WARN, value, advice)
    return Diagnosis(what, PASS, value)


def find_log_folder() -> Path:
    """Return where ROS writes its log files; without one rclpy does not start."""
    if folder := os.environ.get('ROS_LOG_DIR'):
        return Path(folder).expanduser()
    home = os.environ.get('ROS_HOME') or '~/.ros'
    return Path(home).expanduser() / 'log'


def check_log_folder(folder: Path) -> Diagnosis:
    """Check whether ROS can write its log files."""
    if _is_writable(folder):
        return Diagnosis('ROS logs', PASS, f'go to {folder}')
    seen = f'{folder} cannot be written'
    return Diagnosis('ROS logs', FAIL, seen, 'set ROS_LOG_DIR to a writable folder')


def check_disk(folder: Path, plenty: float = 1e9, least: float = 1e8) -> Diagnosis:
    """Check whether there is room for recordings: `plenty` of free bytes, or with a warning
    `least`.
    """
    what = 'room for records'
    existing = _find_existing(folder)
    if not _is_writable(folder):
        return Diagnosis(what, FAIL, f'{existing} cannot be written', 'name another folder')
    free = shutil.disk_usage(existing).free
    seen = f'{free / 1e9:.1f} GB free in {existing}'
    if free >= plenty:
        return Diagnosis(what, PASS, seen)
    verdict = WARN if free >= least else FAIL
    return Diagnosis(what, verdict, seen, 'delete old sessions, or record elsewhere')


def check_node(name: str, wait: float) -> Diagnosis:
    """Check whether a memory node answers, for some seconds."""
    from mlmem_ros.contract.calls import RequestError
    from mlmem_ros.ros.client.client import standalone

    what = f'node {name}'
    try:
        with standalone(name) as client:
            client.ready(wait).wait()
            values = client.parameters('element', 'use_sim_time').wait()
            clocks = client.node.count_publishers('/clock')
    except RequestError:
        return Diagnosis(
            what,
            WARN,
            f'does not answer within {wait:g} s',
            'if it should run: ros2 run mlmem_ros memory_node; check name and ROS_DOMAIN_ID',
        )
    except Exception as error:  # rclpy could not start at all
        return Diagnosis(what, FAIL, str(error).splitlines()[0], 'see the lines above')
    if values['use_sim_time'] and not clocks:
        seen = 'answers, but waits for a /clock that nobody publishes'
        return Diagnosis(
            what, WARN, seen, 'start what publishes /clock, or the node with use_sim_time: false'
        )
    seen = f'answers: element {values["element"]}'
    return Diagnosis(what, PASS, seen)


def _find_version(name: str) -> str:
    return packages.find_installed_version(name, f'ros-jazzy-{name}') or 'of unknown version'


def _find_existing(folder: Path) -> Path:
    """Return a folder, or its nearest existing parent."""
    folder = folder.absolute()
    return next(each for each in (folder, *folder.parents) if each.exists())


def _is_writable(folder: Path) -> bool:
    existing = _find_existing(folder)
    return existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)
