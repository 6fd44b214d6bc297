# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Record the golden sessions under test/data with a running memory node.

Usage: .venv/bin/python tools/record_golden.py. Renew them only when the format or the device
is meant to have changed, and say so.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from std_msgs.msg import Float64, UInt8

from mlmem_ros.ros.client import MemoryClient
from mlmem_ros.ros.qos import RELIABLE

DATA = Path(__file__).resolve().parent.parent / 'test' / 'data'
SPARSE = ('publish.field_every:=100', 'publish.wall_every:=100', 'publish.joint_states_every:=20')


def life(client: MemoryClient) -> None:
    """Write, read, erase, read."""
    client.write(2)
    client.read()
    client.erase()
    client.read()


def manual_drive(client: MemoryClient) -> None:
    """Write level 0, then drive the wall one level on by hand."""
    strain = client.node.create_publisher(Float64, '/mlmem/strain', RELIABLE)
    client.wait_until(lambda: strain.get_subscription_count() > 0)
    client.write(0)
    for target, seconds in ((-0.034, 0.25), (0.0, 0.4)):
        strain.publish(Float64(data=target))
        client.spin(seconds)
    client.read()


def aborted_write(client: MemoryClient) -> None:
    """Begin to write level 3, abort on the way, read what is there."""
    write_level = client.node.create_publisher(UInt8, '/mlmem/write_level', RELIABLE)
    client.wait_until(lambda: write_level.get_subscription_count() > 0)
    write_level.publish(UInt8(data=3))
    client.spin(1.3)
    client.abort()
    client.write(1)
    client.read()


def record(name: str, scenario: Callable[[MemoryClient], None]) -> None:
    """Run a scenario against a node that records it."""
    bag = DATA / name
    shutil.rmtree(bag, ignore_errors=True)
    command = [sys.executable, '-m', 'mlmem_ros.ros.main', '--ros-args']
    for parameter in (f'record.path:={bag}', *SPARSE):
        command += ['-p', parameter]
    process = subprocess.Popen(command)
    try:
        with MemoryClient() as client:
            client.wait_for_node(60.0)
            scenario(client)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20.0)


if __name__ == '__main__':
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(random.randint(1, 100)))
    for each in (life, manual_drive, aborted_write):
        record(each.__name__, each)
        time.sleep(0.5)
