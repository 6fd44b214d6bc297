# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Faults as parameters, and the shaken base: over DDS, recorded, replayed."""

import json
import math
from contextlib import suppress

import numpy as np
from nodes import QUICK, arrived, end_node
from robot import BLANK, Robot
from sensor_msgs.msg import Imu

from mlmem import Disturb, SetFaults, load_element
from mlmem_ros.contract.answers import NoAnswer
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay

DESIGN = load_element(QUICK['element']).design

UNIT = 0.01 / 1e-5**2
"""One lattice constant per time unit squared in m/s^2 at this element's scale."""


GIVEN = {'write.method': 'strain'}
"""Faults of an actuator leave a kick as it is."""


def imu(acceleration):
    message = Imu()
    message.header.frame_id = 'base_link'
    message.linear_acceleration.x = acceleration
    message.linear_acceleration.y = 9.81  # across the chain: no effect
    return message


def test_base_shakes_the_chain_and_stops_by_itself(robot):
    """An acceleration of a thousandth of the unit bends inactive cells by 1e-3 / k_s1 = 4.5e-3."""

    def bend(field):
        return DESIGN.D_s1 - np.mean(field.data)

    assert robot.trigger('erase').success
    # a field sent as the erase ends still rings by 2.6e-5
    robot.next('field', lambda field: abs(bend(field)) < 1e-6)
    fields = robot.received('field')
    seen = len(fields)

    def shaken():
        """Keep shaking: a message acts for 10 ms here, and a field comes every 20."""
        robot.send_message('disturbance', imu(5e-4 * UNIT))
        return next((field for field in fields[seen:] if bend(field) > 1e-3), None)

    assert all(math.isfinite(x) for x in robot.wait(shaken, 'a bent field').data)
    # without a further message it is at rest after 1000 time units, and the chain rings down
    robot.next('field', lambda field: abs(bend(field)) < 1e-5)


def close_session(node, bag):
    """End a node and return the session that it has recorded."""
    end_node(node)
    return load_session(bag)


def shake(robot, acceleration, pending):
    """Send an acceleration until it pends: it is lost if the node has not met its sender yet."""
    for last in 40 * [False] + [True]:
        robot.send_message('disturbance', imu(acceleration))
        with suppress(() if last else NoAnswer):
            return wait_until(lambda: pending, 'the acceleration', 0.5)


def test_session_with_faults_and_shaking_replays(start, tmp_path):
    """With faults from the start, faults that change, and a base that shakes during a write."""
    bag = tmp_path / 'bag'
    # so little disorder that the wall arrives
    faults = {'disorder_alpha': 2e-5, 'sensor_noise': 1e-6, 'actuator_lag': 30.0}
    given = {f'faults.{name}': value for name, value in faults.items()}
    node = start({'scale.time': 1e-5, 'record.path': str(bag), **given}, name='shaken')
    with Robot(node.element) as robot:
        robot.set(target_level=1)
        with robot.paused():  # or what comes during the write would depend on the machine
            answer = robot.send('write')
            arrived(node)
            shakes = node.node.host.loop._box.shakes
            for n in range(1, 21):
                shake(robot, 1e-7 * UNIT * math.sin(n), shakes)
                node.step(5)
                if n == 10:
                    robot.set(faults__weak_cell=90, faults__weak_factor=0.98)
            assert not answer.done()
        assert robot.answer(answer).success
        robot.set(faults__sensor_noise=0.0)
        assert robot.trigger('read')['level'] == 1
    session = close_session(node, bag)
    kinds = [type(command) for _, command in session.stamped]
    assert kinds[0] is SetFaults
    assert kinds.count(Disturb) == 20  # while time is paused, one sent again replaces the last
    report = run_replay(session)
    assert report.exact, report
    assert report.refused == []


def test_element_out_of_its_phases_is_reset(start, tmp_path):
    """A grip off by a strain of 0.05 pushes cells on and on; no restart brings them back."""
    state, bag = tmp_path / 'element.json', tmp_path / 'session'
    kept = {'state.path': str(state), 'write.method': 'strain'}
    node = start({**kept, 'faults.actuator_offset': 0.05, 'time.speed': 0.0}, name='lost')
    with Robot('/lost') as robot:
        assert not robot.write(3).success
        robot.set(faults__actuator_offset=0.0)
        end_node(node)
    node = start({**kept, 'record.path': str(bag)}, name='again')
    with Robot('/again') as robot:
        assert 'reset replaces it by a blank one' in robot.trigger('read')['error']
        assert robot.trigger('reset')['level'] == BLANK
        assert robot.write(5)['level'] == 5
        assert run_replay(close_session(node, bag)).exact
    assert json.loads(state.read_text())['snapshot']['statistics']['resets'] == 1
