# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot that shakes its memory: it walks, loses power, falls, and walks on with what it knows.

A hexapod in MuJoCo carries an element, whose base its body shakes. What it must not forget is a
byte in there: how it walks, and how often it has fallen. World and memory run in lockstep, so that
the same day has the same bits whenever it is run.

    pip install 'mlmem_ros[robot]'
    python3 examples/walking_robot/walking_robot.py --output day

draws the day, and leaves its session to `mlmem replay day/session`. With `--film` it is filmed;
without a screen set MUJOCO_GL to egl or osmesa.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import try_shutdown
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from mlmem_ros import MemoryClient
from mlmem_ros.contract.topics import Qos
from mlmem_ros.packages import describe_missing
from mlmem_ros.testing import memory_node

try:
    from film import Film
    from hexapod import GAITS, TIME_STEP_S, Gait, Hexapod
except ModuleNotFoundError as error:  # MuJoCo, or what draws
    sys.exit(describe_missing(error))

MEMORY_PARAMETERS = {'element': 'byte', 'publish.field_every': 0, 'publish.wall_every': 0}

MAX_STONE_HEIGHT_M = 0.1
"""Height of the highest stones in m: it walks 0.13 m above the ground."""

MAX_FALLS = 16
"""Most falls that fit into a byte beside the gait."""


class Brain:
    """What runs on the robot's computer: it knows nothing when it starts, but what it can read.

    Attributes:
        gait: The present gait.
        falls: How often the robot has lost power while it walked.
        log: What it said, with the time in seconds.
    """

    def __init__(self, memory: MemoryClient, log: list[tuple[float, str]]) -> None:
        """Stand, and ask the memory."""
        self.gait, self.falls, self.log = 0, 0, log
        self._memory = memory
        self._reading: Any = memory.read()
        self._writing: Any = None

    @property
    def word(self) -> int | None:
        """What it knows to be in the memory; None while it asks."""
        return None if self._reading or self._writing else self.falls * MAX_FALLS + self.gait

    def choose_gait(self, time: float, wanted: int) -> Gait:
        """Return how to walk now; a new gait is written before it is walked."""
        if self._reading is not None:
            if self._reading.done():
                self._take_content(time, self._reading.wait())
        elif self._writing is not None:
            if self._writing.done():
                self.falls, self.gait = divmod(self._writing.wait().content, MAX_FALLS)
                self._writing = None
                self._log_message(time, f'{GAITS[self.gait].name} is written; falls: {self.falls}')
        elif wanted != self.gait:
            self._write_word(self.falls, wanted)
        return GAITS[self.gait]

    def _take_content(self, time: float, content: Any) -> None:
        self._reading = None
        falls, gait = divmod(max(0, content.content), MAX_FALLS)
        if gait == 0:
            self._log_message(time, 'the memory says stand: a new robot')
            return
        self._log_message(time, f'the memory says {GAITS[gait].name}; falls: {falls}')
        self._write_word(falls + 1, gait)  # it was walking when it lost power

    def _write_word(self, falls: int, gait: int) -> None:
        self._writing = self._memory.write(min(falls, MAX_FALLS - 1) * MAX_FALLS + gait)

    def _log_message(self, time: float, what: str) -> None:
        self.log.append((round(time, 3), what))


class World(Node):
    """The body and its sensors, and a memory whose time is that of the body."""

    def __init__(self, body: Hexapod, element: str, **options: Any) -> None:
        """Hold the time of an element; `run` lets it pass."""
        super().__init__('walker', **options)
        self.body = body
        self.memory = MemoryClient(self, element, actions=False)
        self._imu = self.create_publisher(Imu, f'{element}/disturbance', Qos.RELIABLE.profile)
        self._joints = self.create_publisher(JointState, '~/joint_states', Qos.RELIABLE.profile)
        self._clock = self.create_publisher(Clock, '/clock', Qos.RELIABLE.profile)
        self.memory.ready().wait()
        self.memory.pause().wait()
        self._reset_element(element)

    def _reset_element(self, element: str) -> None:
        """Begin at tick 0, if there are types to ask for it; or days begin at different ticks."""
        try:
            from simulation_interfaces.srv import ResetSimulation
        except ImportError:
            return
        client = self.create_client(ResetSimulation, f'{element}/reset_simulation')
        client.wait_for_service()
        answer = client.call_async(ResetSimulation.Request())
        executor = SingleThreadedExecutor(context=self.context)
        rclpy.spin_until_future_complete(self, answer, executor)
        executor.shutdown()

    def pass_time(
        self,
        seconds: float,
        brain: Brain | None,
        wanted: int,
        day: DayRecord,
        film: Film | None = None,
    ) -> None:
        """Let time pass, for body and memory together; without a brain there is no power."""
        self.body.powered = brain is not None
        for _ in range(round(seconds / TIME_STEP_S)):
            gait = brain.choose_gait(self.body.time, wanted) if brain is not None else GAITS[0]
            self.body.step(gait)
            self._publish_sensors()
            self.memory.step().wait()  # the messages sent before take effect in this tick
            day.add_step(self.body, gait)
            if brain is not None:
                day.word = brain.word
            if film is not None:
                film.take_picture(self.body, day.find_last_message(self.body.time), day.word)

    def _publish_sensors(self) -> None:
        seconds, nanoseconds = divmod(round(self.body.time * 1e9), 10**9)
        imu, joints, clock = Imu(), JointState(), Clock()
        for header in (imu.header, joints.header):
            header.stamp.sec, header.stamp.nanosec = seconds, nanoseconds
        clock.clock.sec, clock.clock.nanosec = seconds, nanoseconds
        force = imu.linear_acceleration
        force.x, force.y, force.z = self.body.acceleration
        angles = self.body.joints
        joints.name, joints.position = list(angles), list(angles.values())
        for publisher, message in ((self._clock, clock), (self._imu, imu), (self._joints, joints)):
            publisher.publish(message)


@dataclass
class DayRecord:
    """What happened: by step the time in s, the place and the height in m, the acceleration in
    m/s^2 and the frequency of the gait in Hz; what the robot said; the byte that it last knew, or
    None while it asks.
    """

    log: list[tuple[float, str]] = field(default_factory=list)
    steps: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    word: int | None = None

    def add_step(self, body: Hexapod, gait: Gait) -> None:
        """Keep a step."""
        self.steps.append((body.time, *body.place, body.acceleration[0], gait.frequency))

    def find_last_message(self, time: float) -> str:
        """Return what the robot said last, for two seconds."""
        when, what = self.log[-1] if self.log else (0.0, '')
        return what if time - when < 2.0 else ''


def simulate_day(session: Path, roughness: float = 0.02, film: Film | None = None) -> DayRecord:
    """Live a day, recorded into a session and perhaps filmed, and return it.

    The robot is told to walk, loses power on its way, falls, and wakes a second later.
    """
    day = DayRecord()
    context = rclpy.Context()
    rclpy.init(context=context)
    try:
        with memory_node(MEMORY_PARAMETERS) as node:
            world = World(Hexapod(roughness), node.element, context=context)
            world.memory.record(path=str(session)).wait()
            world.pass_time(3.0, Brain(world.memory, day.log), 2, day, film)
            day.log.append((round(world.body.time, 3), 'power is lost'))
            world.pass_time(1.0, None, 0, day, film)
            day.log.append((round(world.body.time, 3), 'power is back'))
            world.pass_time(3.0, Brain(world.memory, day.log), 2, day, film)
            world.memory.record(False).wait()
            world.destroy_node()
    finally:
        try_shutdown(context=context)
    return day


def draw_day(day: DayRecord, path: Path) -> None:
    """Draw a day: how far the robot came, its height, and what the element felt."""
    from matplotlib.figure import Figure

    time, far, high, shake, _ = zip(*day.steps, strict=True)
    figure = Figure(figsize=(8.0, 5.0), layout='constrained')
    axes = figure.subplots(3, sharex=True)
    for each, values, label in zip(
        axes, (far, high, shake), ('way in m', 'height in m', 'acceleration\nin m/s²'), strict=True
    ):
        each.plot(time, values, linewidth=0.8)
        each.set_ylabel(label)
        for when, _ in day.log:
            each.axvline(when, color='0.7', linewidth=0.8)
    above = axes[0].get_xaxis_transform()
    for number, (when, what) in enumerate(day.log):  # on three lines by turns
        axes[0].text(when, 1.03 + 0.13 * (number % 3), what, transform=above, fontsize=7)
    axes[-1].set_xlabel('time in s')
    figure.savefig(path, dpi=150)


def main() -> int:
    """Live a day, and show it."""
    parser = argparse.ArgumentParser(description='A robot that shakes its memory.')
    parser.add_argument('--output', type=Path, default=Path('day'), help='a new folder')
    parser.add_argument('--film', action='store_true', help='film the day, too')
    parser.add_argument('--roughness', type=float, default=0.02, help='height of stones in m')
    options = parser.parse_args()
    if not 0.0 <= options.roughness <= MAX_STONE_HEIGHT_M:
        parser.error(
            f'--roughness must be from 0 to {MAX_STONE_HEIGHT_M:g} m; got {options.roughness:g}'
        )
    try:
        options.output.mkdir(parents=True)
    except OSError as error:
        parser.error(f'--output must name a new folder: {error.strerror}: {options.output}')
    with Film(options.output / 'day.gif') if options.film else nullcontext() as film:
        day = simulate_day(options.output / 'session', options.roughness, film)
    for when, what in day.log:
        print(f'{when:6.3f} s  {what}')
    print(f'it came {day.steps[-1][1]:.2f} m; the byte in its memory is {day.word:#04x}')
    draw_day(day, options.output / 'day.png')
    return 0


if __name__ == '__main__':
    sys.exit(main())
