# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The hardware interface of ros2_control strains an element, where both are installed.

A loop like the controller manager's (hardware/hardware.cpp) loads it from the robot description.
"""

import math
import subprocess
import threading
import xml.etree.ElementTree as ET
from collections import deque
from pathlib import Path

import pytest
import yaml
from cpp import built
from test_ros2_control import FOLDER, limits, pass_time, urdf

SOURCE = Path(__file__).parent / 'hardware'
NEEDED = ('hardware_interface', 'joint_state_topic_hardware_interface')


@pytest.fixture(scope='module')
def program(tmp_path_factory):
    return built(SOURCE, tmp_path_factory.mktemp('hardware'), *NEEDED) / 'hardware'


class Loop:
    """The running program: what it is told, and its last period."""

    def __init__(self, command):
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._periods = deque(maxlen=1)
        self.count = 0
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self._periods.append([float(number) for number in line.split()])
            self.count += 1

    def tell(self, line):
        self._process.stdin.write(f'{line}\n')
        self._process.stdin.flush()

    @property
    def now(self):
        """Command, position, speed and force of the last period."""
        return self._periods[0] if self._periods else [math.nan] * 4

    @property
    def ended(self):
        """Whether it ended by itself, for what it says."""
        return self._process.poll() is not None

    def end(self):
        """End it, and return how it ended."""
        self._process.stdin.close()
        try:
            return self._process.wait(20)
        finally:
            self._process.kill()
            self._reader.join()


@pytest.fixture
def description(memory):
    """The robot description of the module's element, whose time runs ten times as fast."""
    return urdf(element=memory.element, cells=135, time=1e-5)


@pytest.fixture
def loop(program, description, robot, tmp_path):
    file = tmp_path / 'element.urdf'
    file.write_bytes(ET.tostring(description))
    controllers = yaml.safe_load((FOLDER / 'controllers.yaml').read_text())
    rate = controllers['controller_manager']['ros__parameters']['update_rate']
    loop = Loop([program, file, str(rate)])
    robot.wait(lambda: loop.count > rate or loop.ended, 'a second of its periods')
    yield loop
    assert loop.end() == 0


def test_hardware_without_a_command_keeps_the_content(loop, memory, robot):
    before = len(memory.output)
    assert robot.write(3).success
    assert math.isnan(loop.now[0])
    pass_time(robot, 0.5)
    assert robot.latest('level').data == 3
    assert 'refused' not in memory.output[before:]


def test_hardware_commands_are_followed_within_limits(loop, description, robot):
    _, most, fastest = limits(description)
    for asked, reached in ((0.06, 0.06), (10.0, most), (-0.12, -0.12)):
        loop.tell(asked)
        robot.wait(lambda: loop.now[1] == pytest.approx(reached), f'{reached} m')  # noqa: B023
        command, _, speed, _ = loop.now
        assert command == pytest.approx(reached)
        assert abs(speed) <= fastest
    assert loop.now[3] != 0.0, 'a strained element pulls'
    robot.wait(lambda: loop.now[2] == 0.0, 'rest')
