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

# The defaults take up to 3 s to discover a peer and 20 s to miss one that was killed, and leave
# segments in /dev/shm after a SIGKILL. Histories begin as small as a node's own do.
FAST_DISCOVERY = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <profiles>
    <transport_descriptors>
      <transport_descriptor>
        <transport_id>loopback</transport_id>
        <type>UDPv4</type>
        <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
        <maxInitialPeersRange>32</maxInitialPeersRange>
      </transport_descriptor>
    </transport_descriptors>
    <participant profile_name="loopback" is_default_profile="true">
      <rtps>
        <useBuiltinTransports>false</useBuiltinTransports>
        <userTransports><transport_id>loopback</transport_id></userTransports>
        <builtin>
          <discovery_config>
            <leaseDuration><sec>4</sec></leaseDuration>
            <leaseAnnouncement><sec>0</sec><nanosec>200000000</nanosec></leaseAnnouncement>
            <initialAnnouncements>
              <count>10</count><period><sec>0</sec><nanosec>50000000</nanosec></period>
            </initialAnnouncements>
          </discovery_config>
        </builtin>
      </rtps>
    </participant>
    <data_writer profile_name="writer" is_default_profile="true">
      <topic><resourceLimitsQos><allocated_samples>1</allocated_samples></resourceLimitsQos></topic>
    </data_writer>
    <data_reader profile_name="reader" is_default_profile="true">
      <topic><resourceLimitsQos><allocated_samples>1</allocated_samples></resourceLimitsQos></topic>
    </data_reader>
  </profiles>
</dds>
"""


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
    profile = home / 'fast_discovery.xml'
    profile.write_text(FAST_DISCOVERY, encoding='utf-8')
    domain = _claim_domain()
    os.environ.update(
        ROS_DOMAIN_ID=str(domain),
        ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
        ROS_LOG_DIR=str(home / 'log'),
        RMW_IMPLEMENTATION='rmw_fastrtps_cpp',
    )
    os.environ.setdefault('ROS_PYTHON_CHECK_FIELDS', '1')  # empty: as on a robot
    os.environ[profile_variable(os.environ)] = str(profile)
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
