# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Record `bag`: a robot whose behaviour node is restarted twice and keeps its gait.

Usage: python3 record.py, with no other memory node in this ROS domain. Record it anew only
if the device was changed on purpose, together with the bags of scripts/record_golden.py.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from std_msgs.msg import UInt8

from mlmem_ros import MemoryClient, standalone
from mlmem_ros.contract.topics import Qos
from mlmem_ros.ros.client.client import wait_until

PACKAGE_FOLDER = Path(__file__).resolve().parent
STREAM_PERIODS = {'field_every': 200, 'wall_every': 200, 'joint_states_every': 50}
MEMORY_COMMAND = [sys.executable, '-m', 'mlmem_ros.ros.main', '--ros-args']
GAIT_NODE_COMMAND = [sys.executable, '-m', 'gait_store.gait_node']


@contextmanager
def run_process(command: list[str]) -> Iterator[None]:
    """Run a process and interrupt it at the end."""
    process = subprocess.Popen(command, cwd=PACKAGE_FOLDER)
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20.0)


def record_day(bag: Path) -> None:
    """Start the robot three times on one memory, which records a session."""
    shutil.rmtree(bag, ignore_errors=True)
    parameters = {'record.path': bag, **{f'publish.{key}': n for key, n in STREAM_PERIODS.items()}}
    options = [word for key, value in parameters.items() for word in ('-p', f'{key}:={value}')]
    with run_process([*MEMORY_COMMAND, *options]), standalone() as memory:
        memory.ready(60.0).wait()
        gaits: list[int] = []
        memory.node.create_subscription(
            UInt8, '/gait/gait', lambda message: gaits.append(message.data), Qos.LATCHED.profile
        )
        for before, after in ((0, 1), (1, 3), (3, 3)):
            gaits.clear()
            with run_process(GAIT_NODE_COMMAND):
                wait_until(lambda: gaits, 'the gait it remembers', 60.0)
                if after != before:
                    request_gait(memory, after)
                    wait_until(lambda: len(gaits) == 2, 'the gait it takes up', 60.0)
            assert gaits == sorted({before, after}), gaits


def request_gait(memory: MemoryClient, gait: int) -> None:
    """Ask the behaviour node for another gait."""
    publisher = memory.node.create_publisher(UInt8, '/gait/set_gait', Qos.RELIABLE.profile)
    wait_until(publisher.get_subscription_count, 'the behaviour node')
    publisher.publish(UInt8(data=gait))
    wait_until(lambda: publisher.wait_for_all_acked(), 'its acknowledgement')
    memory.node.destroy_publisher(publisher)


if __name__ == '__main__':
    record_day(PACKAGE_FOLDER / 'bag')
