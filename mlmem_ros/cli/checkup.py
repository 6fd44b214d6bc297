# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a machine needs, checked item by item. Each check reports what it found, with advice."""

from __future__ import annotations

import importlib
import os
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from ..packages import advice
from ..verdict import Verdict

PYTHONS = ((3, 10), (3, 14))
"""Oldest and newest tested Python."""

LIBRARIES = {
    'numpy': '',
    'numba': '',
    'yaml': '',
    'mcap': 'recording and replay',
    'rosbags': 'recording and replay',
    'rich': 'most commands',
    'matplotlib': 'pictures',
    'scipy': 'figures and tolerance',
}
"""Python packages, and the only use that needs them; without the others no node starts."""

INTERFACES = ('std_msgs', 'std_srvs', 'sensor_msgs', 'diagnostic_msgs', 'rcl_interfaces')
"""ROS packages whose messages the node and its client use."""

LAST_DOMAIN = 232
"""Greatest ROS_DOMAIN_ID: above it DDS runs out of ports."""

LAST_SAFE_DOMAIN = 101
"""Greatest one whose ports Linux does not use."""

ROS_ADVICE = 'source /opt/ros/jazzy/setup.bash, or install the wheels: make setup'


@dataclass(frozen=True)
class Diagnosis:
    """What a check found.

    Attributes:
        what: What was looked at.
        verdict: Whether it is as required.
        seen: What was seen.
        advice: What to do; empty if nothing is needed.
    """

    what: str
    verdict: Verdict
    seen: str
    advice: str = ''


def examine(node: str, wait: float, records: Path) -> Iterator[Diagnosis]:
    """Check everything, item by item.

    Args:
        node: Name of a memory node that may be running.
        wait: How long to wait for it, in seconds.
        records: Where sessions will be recorded.
    """
    yield check_python(sys.version_info[:2])
    for name in LIBRARIES:
        yield check_library(name)
    yield check_compile_cache()
    yield check_processor()
    ros = check_ros()
    yield ros
    yield check_domain(os.environ.get('ROS_DOMAIN_ID'))
    yield check_log_folder(log_folder())
    yield check_disk(records)
    if ros.verdict is not Verdict.FAIL:
        yield check_node(node, wait)


def check_python(version: tuple[int, ...]) -> Diagnosis:
    """Check the version of Python."""
    seen = '.'.join(map(str, version))
    if not PYTHONS[0] <= version <= PYTHONS[1]:
        oldest, newest = ('.'.join(map(str, bound)) for bound in PYTHONS)
        verdict = Verdict.FAIL if version < PYTHONS[0] else Verdict.WARN
        return Diagnosis('Python', verdict, seen, f'use Python {oldest} to {newest}')
    return Diagnosis('Python', Verdict.PASS, seen)


def check_library(name: str) -> Diagnosis:
    """Check whether a Python package can be imported."""
    try:
        module = importlib.import_module(name)
    except Exception as error:  # a broken installation may raise anything
        use = LIBRARIES.get(name)
        seen = f'{error}: no {use}' if use else str(error)
        return Diagnosis(name, Verdict.WARN if use else Verdict.FAIL, seen, advice(name))
    return Diagnosis(name, Verdict.PASS, getattr(module, '__version__', '') or _version(name))


def check_compile_cache() -> Diagnosis:
    """Check whether compiled kernels can be cached, or every start compiles them again."""
    what = 'compiled kernels'
    try:
        from ..physics import NOH_BATHE
        from ..physics.jit import cache_folder
    except ImportError as error:
        return Diagnosis(what, Verdict.FAIL, str(error), advice('numba'))
    if (folder := cache_folder(NOH_BATHE.advance)) is not None and _writable(folder):
        return Diagnosis(what, Verdict.PASS, f'kept in {folder}')
    return Diagnosis(
        what,
        Verdict.WARN,
        'cannot be cached: every start takes some seconds longer',
        'set NUMBA_CACHE_DIR to a writable folder',
    )


def check_processor() -> Diagnosis:
    """Check whether the processor has the instruction that makes the kernels fast."""
    what = 'processor'
    try:
        from ..physics.jit import fused
    except ImportError as error:
        return Diagnosis(what, Verdict.FAIL, str(error), advice('numba'))
    if fused():
        return Diagnosis(what, Verdict.PASS, 'multiplies and adds in one instruction')
    return Diagnosis(
        what,
        Verdict.WARN,
        'has no fused multiply-add: same results, a hundred times slower, not in real time',
        'use one from 2013 or later; a virtual machine must expose it (CPU model: host)',
    )


def check_ros() -> Diagnosis:
    """Check for rclpy, its middleware and the message packages."""
    try:
        import rclpy
        from rclpy.utilities import get_rmw_implementation_identifier

        for package in INTERFACES:
            importlib.import_module(package)
        del rclpy
        middleware = get_rmw_implementation_identifier()
    except Exception as error:  # the middleware is loaded here and may raise anything
        return Diagnosis('ROS 2', Verdict.FAIL, str(error), ROS_ADVICE)
    distribution = os.environ.get('ROS_DISTRO', 'jazzy')
    if distribution != 'jazzy':
        seen = f'{distribution}, {middleware}'
        return Diagnosis('ROS 2', Verdict.WARN, seen, 'only Jazzy is tested')
    return Diagnosis('ROS 2', Verdict.PASS, f'rclpy {_version("rclpy")}, {middleware}')


def check_domain(value: str | None) -> Diagnosis:
    """Check ROS_DOMAIN_ID: nodes of another domain are invisible."""
    what = 'ROS_DOMAIN_ID'
    if not value:
        local = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE', '') in ('LOCALHOST', 'OFF')
        if local:
            return Diagnosis(what, Verdict.PASS, 'not set: 0, on this machine only')
        seen = 'not set: 0, shared with everybody on this network'
        return Diagnosis(what, Verdict.WARN, seen, 'give your robot its own number')
    if not value.isdecimal() or int(value) > LAST_DOMAIN:
        return Diagnosis(what, Verdict.FAIL, value, f'set a number from 0 to {LAST_SAFE_DOMAIN}')
    if int(value) > LAST_SAFE_DOMAIN:
        advice = f'above {LAST_SAFE_DOMAIN} Linux may use its ports for something else'
        return Diagnosis(what, Verdict.WARN, value, advice)
    return Diagnosis(what, Verdict.PASS, value)


def log_folder() -> Path:
    """Return where ROS writes its log files; without one rclpy does not start."""
    if folder := os.environ.get('ROS_LOG_DIR'):
        return Path(folder).expanduser()
    home = os.environ.get('ROS_HOME') or '~/.ros'
    return Path(home).expanduser() / 'log'


def check_log_folder(folder: Path) -> Diagnosis:
    """Check whether ROS can write its log files."""
    if _writable(folder):
        return Diagnosis('ROS logs', Verdict.PASS, f'go to {folder}')
    seen = f'{folder} cannot be written'
    return Diagnosis('ROS logs', Verdict.FAIL, seen, 'set ROS_LOG_DIR to a writable folder')


def check_disk(folder: Path, plenty: float = 1e9, least: float = 1e8) -> Diagnosis:
    """Check whether there is room for recordings.

    Args:
        folder: Where they will be.
        plenty: Free bytes from which all is well.
        least: Free bytes below which nothing should be recorded.
    """
    what = 'room for records'
    existing = _existing(folder)
    free = shutil.disk_usage(existing).free
    seen = f'{free / 1e9:.1f} GB free in {existing}'
    if not _writable(folder):
        seen = f'{existing} cannot be written'
        return Diagnosis(what, Verdict.FAIL, seen, 'name another folder')
    if free >= plenty:
        return Diagnosis(what, Verdict.PASS, seen)
    verdict = Verdict.WARN if free >= least else Verdict.FAIL
    return Diagnosis(what, verdict, seen, 'delete old sessions, or record elsewhere')


def check_node(name: str, wait: float) -> Diagnosis:
    """Check whether a memory node answers.

    Args:
        name: Its name.
        wait: How long to wait for it, in seconds.
    """
    from ..contract.errors import RequestError
    from ..ros.client.standalone import standalone

    what = f'node {name}'
    try:
        with standalone(name) as client:
            client.ready(wait).wait()
            values = client.parameters('design.preset', 'design.N', 'use_sim_time').wait()
            timeless = values['use_sim_time'] and not client.node.count_publishers('/clock')
    except RequestError:
        return Diagnosis(
            what,
            Verdict.WARN,
            f'does not answer within {wait:g} s',
            'if it should run: ros2 run mlmem_ros memory_node; check name and ROS_DOMAIN_ID',
        )
    except Exception as error:  # rclpy could not start at all
        return Diagnosis(what, Verdict.FAIL, str(error).splitlines()[0], 'see the lines above')
    seen = f'answers: {values["design.N"]} cells, preset {values["design.preset"]}'
    if timeless:
        seen = 'answers, but waits for a /clock that nobody publishes'
        advice = 'start what publishes /clock, or the node with use_sim_time: false'
        return Diagnosis(what, Verdict.WARN, seen, advice)
    return Diagnosis(what, Verdict.PASS, seen)


def _version(name: str) -> str:
    for package in (name, f'ros-jazzy-{name}'):
        try:
            return metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return 'of unknown version'


def _existing(folder: Path) -> Path:
    """Return a folder, or its nearest existing parent."""
    folder = folder.absolute()
    return next(each for each in (folder, *folder.parents) if each.exists())


def _writable(folder: Path) -> bool:
    existing = _existing(folder)
    return existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)
