# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A private ROS graph for a test run: its domain, discovery over the loopback, logs."""

from __future__ import annotations

import atexit
import fcntl
import functools
import os
import shutil
import socket
import tempfile
from pathlib import Path

from ..ros.fast_dds import profile_variable

PARTICIPANTS = 10
"""Discovery ports of a domain that are looked at."""

FAST_DISCOVERY = Path(__file__).with_name('fast_discovery.xml')
"""The profile of Fast DDS."""


@functools.cache
def isolate() -> int:
    """Keep this process and all that it starts out of other ROS graphs; return the ROS domain.

    Call it in a `conftest.py`, before anything initialises rclpy. Each parallel run on a machine
    gets a domain of its own.

    Raises:
        RuntimeError: No domain is left.
    """
    home = Path(tempfile.mkdtemp(prefix='mlmem-ros-'))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    domain = _claim_domain()
    os.environ.update(
        ROS_DOMAIN_ID=str(domain),
        ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
        ROS_LOG_DIR=str(home / 'log'),
        RMW_IMPLEMENTATION='rmw_fastrtps_cpp',
    )
    os.environ.setdefault('ROS_PYTHON_CHECK_FIELDS', '1')  # empty: as on a robot
    os.environ[profile_variable(os.environ)] = str(FAST_DISCOVERY)
    return domain


def _claim_domain() -> int:
    for offset in range(100):
        domain = 1 + (os.getpid() + offset) % 100
        if in_use(domain):
            continue
        path = Path(tempfile.gettempdir(), f'mlmem-ros-domain-{domain}.lock')
        lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)  # held until this process ends
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
        else:
            return domain
    raise RuntimeError('all ROS domains from 1 to 100 are in use')


def in_use(domain: int) -> bool:
    """Return whether somebody on this machine, such as a robot or a daemon, is in a ROS domain.

    A participant listens at the first free of the domain's discovery ports (RTPS 2.5, 9.6.2.3).
    """
    for participant in range(PARTICIPANTS):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', 7410 + 250 * domain + 2 * participant))
            except OSError:
                return True
    return False
