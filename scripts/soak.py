# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An hour in the life of a memory node: random requests, an IMU, every stream, a recording.

    make soak MINUTES=60

The node runs as a process at its default pace, keeps its content in a file and records all the
time. Requests come one after the other; all its streams are listened to, and an IMU shakes it 200
times a second. The counts are printed at the end. Exit status 1: a level was wrong, or the node
did not end well.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault('ROS_DOMAIN_ID', str(random.SystemRandom().randint(1, 100)))
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import qos_profile_sensor_data
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from sensor_msgs.msg import Imu

from mlmem_ros import RequestFailed
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.testing import RunningNode, memory_node


class Soak:
    """What was asked of a node, and what was counted."""

    def __init__(self, shake: float, seed: int) -> None:
        self.shake = shake
        self.chance = random.Random(seed)
        self.counts: Counter[str] = Counter()
        self.beyond: list[float] = []  # milliseconds of a request beyond the ticks of its physics
        self.memory: list[float] = []
        self.loop: dict[str, str] = {}
        self.content = -1

    def subscribe_streams(self, memory):
        """Subscribe to everything, and be an IMU."""
        node = memory.node
        for name, stream in STREAMS.items():
            topic = f'/mlmem/{name}'
            node.create_subscription(
                stream.kind, topic, self._count_message, qos_profile_sensor_data
            )
        node.create_subscription(DiagnosticArray, '/diagnostics', self._take_diagnostics, 10)
        imu = node.create_publisher(Imu, '/mlmem/disturbance', qos_profile_sensor_data)

        def shake():
            message = Imu()
            message.linear_acceleration.x = self.chance.gauss(0.0, self.shake)
            imu.publish(message)
            self.counts['imu'] += 1

        node.create_timer(0.005, shake)

    def _count_message(self, message):
        self.counts['messages'] += 1

    def _take_diagnostics(self, array):
        for status in array.status:
            if status.name == 'mlmem: loop':
                self.loop = {pair.key: pair.value for pair in status.values}

    def request_randomly(self, memory):
        """Make one random request, and judge its answer."""
        what = self.chance.choice(('write', 'write', 'read', 'read', 'erase'))
        begun = time.monotonic()
        try:
            if what == 'write':
                wanted = self.chance.randrange(8)
                answer = memory.write(wanted, timeout=120.0).wait()
            else:
                wanted = self.content if what == 'read' else -1
                answer = getattr(memory, what)(timeout=120.0).wait()
        except RequestFailed as failure:
            self.counts[f'{what} failed'] += 1
            print(f'{what}: {failure}', file=sys.stderr)
            self.content = memory.read(timeout=60.0).wait().level  # or the soak ends here
            return
        seconds = 2e-3 * answer.ticks  # of its ticks at the defaults
        self.beyond.append(1e3 * (time.monotonic() - begun - seconds))
        self.counts[what] += 1
        self.content = wanted
        self.counts['wrong'] += answer.level != wanted

    def measure_process(self, node: RunningNode):
        """Measure memory, threads and files of the node."""
        status = Path(f'/proc/{node.pid}/status').read_text()
        values = dict(line.split(':', 1) for line in status.splitlines())
        self.memory.append(int(values['VmRSS'].split()[0]) / 1e3)
        self.counts['threads'] = int(values['Threads'])
        self.counts['files'] = len(os.listdir(f'/proc/{node.pid}/fd'))

    def summarise_counts(self, seconds: float, session: Path) -> dict[str, object]:
        """Return what was counted."""
        bag = BagReader(session)
        size = sum(file.stat().st_size for file in session.iterdir())
        beyond = np.percentile(self.beyond, (50, 99, 100)).round(1).tolist()
        return {
            'minutes': round(seconds / 60.0, 1),
            'writes, reads, erases': [self.counts[name] for name in ('write', 'read', 'erase')],
            'failed, and said so': sum(n for name, n in self.counts.items() if 'failed' in name),
            'wrong levels': self.counts['wrong'],
            'ms beyond the physics: p50, p99, worst': beyond,
            'ticks': int(self.loop['ticks']),
            'ticks skipped': int(self.loop['overruns']),
            'defects caught': int(self.loop['defects']),
            'IMU messages': self.counts['imu'],
            'stream messages heard': self.counts['messages'],
            'RSS in MB: first, median, last': np.round(
                [self.memory[0], np.median(self.memory), self.memory[-1]]
            ).tolist(),
            'threads, open files at the end': [self.counts['threads'], self.counts['files']],
            'session': f'{bag.message_count} messages, {size / 1e6:.0f} MB',
            'losses in the session': len(bag.losses),
        }


def main() -> int:
    """Run; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', type=float, default=60.0)
    parser.add_argument('--shake', type=float, default=0.5, help='IMU noise in m/s^2, rms')
    parser.add_argument('--seed', type=int, default=1)
    given = parser.parse_args()
    console = Console()
    folder = Path(tempfile.mkdtemp(prefix='mlmem-soak-'))
    soak, session = Soak(given.shake, given.seed), folder / 'session'
    parameters = {'state.path': str(folder / 'element.json'), 'record.path': str(session)}
    bar = (TextColumn('soaking'), BarColumn(), TimeRemainingColumn())
    with memory_node(parameters, apart=True) as node:
        memory, begun = node.memory, time.monotonic()
        with Progress(*bar, console=console) as progress:
            task = progress.add_task('', total=60.0 * given.minutes)
            soak.subscribe_streams(memory)
            wait_until(lambda: soak.loop.get('ticks'), 'the node', 60.0)
            assert memory.read(timeout=60.0).wait().blank
            while (passed := time.monotonic() - begun) < 60.0 * given.minutes:
                soak.request_randomly(memory)
                soak.measure_process(node)
                progress.update(task, completed=passed)
            time.sleep(1.5)  # a last report
        seconds = time.monotonic() - begun
        node.signal(signal.SIGINT)
        status = node.exit_status(60.0)
        (folder / 'node.txt').write_text(node.output, encoding='utf-8')
    result = soak.summarise_counts(seconds, session) | {'exit status of the node': status}
    table = Table('counted', 'value')
    for name, value in result.items():
        table.add_row(name, str(value))
    console.print(table)
    print(f'log and session: {folder}')
    return int(bool(result['wrong levels'] or status))


if __name__ == '__main__':
    sys.exit(main())
