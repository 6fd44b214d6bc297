# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Record the golden sessions under test/data with a running memory node.

Usage: .venv/bin/python scripts/record_golden.py. Renew them only after an intended change of the
format or the device, and say so; examples/gait_store/record.py renews the one there.
"""

import os
import random
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rclpy.publisher import Publisher
from std_msgs.msg import Float64, UInt8

from mlmem_ros import MemoryClient
from mlmem_ros.contract.topics import Qos
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.testing import memory_node

DATA_FOLDER = Path(__file__).resolve().parent.parent / 'test' / 'data'
STREAM_PERIODS = {
    'publish.field_every': 100, 'publish.wall_every': 100, 'publish.joint_states_every': 20,
}  # fmt: skip


def life(memory: MemoryClient) -> None:
    """Write, read, erase, come to rest, read."""
    memory.write(2).wait()
    memory.read().wait()
    memory.erase().wait()
    time.sleep(3.0)
    memory.read().wait()


def manual_drive(memory: MemoryClient) -> None:
    """Write level 0, then drive the wall one level on by hand."""
    strain = create_publisher(memory, Float64, 'strain')
    memory.write(0).wait()
    for target, seconds in ((-0.034, 0.25), (0.0, 0.4)):
        strain.publish(Float64(data=target))
        time.sleep(seconds)
    memory.read().wait()


def aborted_write(memory: MemoryClient) -> None:
    """Begin to write level 3, abort on the way, read what is there."""
    create_publisher(memory, UInt8, 'write_level').publish(UInt8(data=3))
    time.sleep(1.3)
    memory.abort().wait()
    memory.write(3).wait()
    memory.read().wait()


def create_publisher(memory: MemoryClient, kind: type[Any], topic: str) -> Publisher:
    """Return a publisher that the memory node listens to."""
    made = memory.node.create_publisher(kind, f'{memory.name}/{topic}', Qos.RELIABLE.profile)
    wait_until(made.get_subscription_count, f'a subscriber of {topic}')
    return made


def record_scenario(name: str, scenario: Callable[[MemoryClient], None]) -> None:
    """Run a scenario against a node that records it."""
    bag = DATA_FOLDER / name
    shutil.rmtree(bag, ignore_errors=True)
    with memory_node({'record.path': str(bag), **STREAM_PERIODS}, apart=True) as node:
        node.memory.ready(60.0).wait()
        time.sleep(2.0)  # on a busy machine the first tick of a recording comes late
        scenario(node.memory)


if __name__ == '__main__':
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(random.randint(1, 100)))
    for each in (life, manual_drive, aborted_write):
        record_scenario(each.__name__, each)
        time.sleep(0.5)
