# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`use_sim_time`: the clock of a simulator, which may jump either way."""

import re
from types import SimpleNamespace

import pytest
from nodes import end_node
from rclpy.clock import ClockType, ROSClock
from rclpy.time import Time
from robot import values
from rosgraph_msgs.msg import Clock
from suite import TIMEOUT_S

from mlmem_ros import NoAnswer
from mlmem_ros.ros.node import simulator
from mlmem_ros.ros.node.simulator import SimTimePacer
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay


class Simulator:
    """Publishes /clock, from `now` on, while its robot waits: a step every period, both in s."""

    def __init__(self, robot, now, step, period):
        self.now, self.step = now, step
        self._publisher = robot.node.create_publisher(Clock, '/clock', 10)
        robot.wait(self._publisher.get_subscription_count, 'a subscriber of /clock')
        robot.node.create_timer(period, self.advance)

    def advance(self):
        self.now += self.step
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(round(1e9 * self.now), 10**9)
        self._publisher.publish(message)


def test_clock_that_jumps_loses_no_time_and_replays(start_robot, tmp_path):
    """A simulator that starts at 100 s, is set forward during a write, and back to its start."""
    bag = tmp_path / 'session'
    robot = start_robot({'use_sim_time': True, 'record.path': str(bag)})
    clock = Simulator(robot, 100.0, step=1e-3, period=2e-3)
    robot.next_status('loop', lambda status: status.message == 'running')
    robot.set(target_level=3)
    writing = robot.send('write')
    robot.next('field')
    clock.now += 1e5
    assert robot.answer(writing)['level'] == 3
    loop = robot.next_status('loop', lambda status: status.message == 'running')
    found = values(loop)
    assert (loop.level, found['overruns'], found['clock_jumps']) == (b'\0', '0', '2')
    clock.now = 0.5
    assert robot.write(2).success
    assert robot.trigger('read')['level'] == 2
    end_node(robot.memory)
    assert 'too slow' not in robot.memory.output
    assert 'the clock has jumped: the device goes on without a gap' in robot.memory.output
    session = load_session(bag)
    report = run_replay(session)
    assert report.exact, report.verdict
    assert report.endings[-2:] == ['write 2', 'read 2']
    times = [time for time, _ in session.outcomes]
    assert times == sorted(times)  # seconds go on where the clock went back


def test_clock_that_does_not_run_is_reported(start_robot, capfd):
    """By client, log and diagnostics."""
    robot, printed = start_robot({'use_sim_time': True}), []
    client, reason = robot.memory.memory, 'no /clock has arrived yet'
    write = client.write(1, timeout=TIMEOUT_S)

    def is_printed():
        printed.append(capfd.readouterr().err)
        return re.search(f'write 1 waits for /mlmem: .*{reason}', ''.join(printed))

    robot.wait(is_printed, reason)
    loop = robot.next_status('loop', lambda status: reason in status.message)
    assert loop.level == b'\1'
    assert reason in robot.memory.output
    with pytest.raises(NoAnswer, match=reason):
        client.read(timeout=0.5).wait()
    assert write.cancel()


def test_pacer_names_why_its_clock_stands_still(monkeypatch):
    wall = SimpleNamespace(now=0.0)
    monkeypatch.setattr(simulator, 'time', SimpleNamespace(monotonic=lambda: wall.now))
    clock = ROSClock()
    clock._set_ros_time_is_active(True)
    pacer = SimTimePacer(clock)
    ros_time = 0.0
    for step, problem in (
        (0.0, 'no /clock has arrived yet'),
        (100.0, 'the clock advances in steps of more than 0.5 s'),
        (0.0, '/clock does not advance'),
        (0.4, ''),
        (1.0, 'the clock advances in steps of more than 0.5 s'),
        (-0.4, ''),
    ):
        for _ in range(3):  # once a second
            wall.now, ros_time = wall.now + 1.0, ros_time + step
            clock.set_ros_time_override(Time(seconds=ros_time, clock_type=ClockType.ROS_TIME))
            found = pacer.find_problem()
        assert problem in found if problem else found == ''
