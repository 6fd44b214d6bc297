# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The files for ros2_control agree with the node.

There are no wheels of the controller manager and its controllers. `Hardware` does with the two
topics what their hardware interface does.
"""

import io
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml
from nodes import QUICK, arrived
from sensor_msgs.msg import JointState

from mlmem import ELEMENT_NAMES, load_element
from mlmem.instrument.instrument import Units

FOLDER = Path(__file__).parents[2] / 'config' / 'ros2_control'


def urdf(**arguments):
    """Return the robot description that xacro makes, by default of the preset of a robot."""
    xacro = pytest.importorskip('xacro')
    given = {name: str(value) for name, value in arguments.items()}
    text = xacro.process_file(FOLDER / 'element.urdf.xacro', mappings=given).toxml()
    return ET.parse(io.StringIO(text)).getroot()


def limits(robot_description):
    """Return the limits of the joint: lower, upper, speed."""
    limit = robot_description.find('joint/limit')
    return [float(limit.get(name)) for name in ('lower', 'upper', 'velocity')]


def node_limits(name):
    """Return the limits of strain by hand for a preset, in m and m/s, and its xacro arguments."""
    design, settings = load_element(name).design_and_settings
    units, actuator = Units(design, settings.scale), settings.actuator
    far = actuator.max_strain * units.elongation
    fast = actuator.hand_rate_limit * units.elongation / settings.scale.time
    return [-far, far, fast], {
        'cells': design.N,
        'length': settings.scale.length,
        'time': settings.scale.time,
        'max_strain': actuator.max_strain,
        'hand_rate': actuator.hand_rate_limit,
    }


def test_joint_limits_are_those_of_the_node():
    assert limits(urdf()) == pytest.approx(node_limits('case_2')[0])
    for name in ELEMENT_NAMES:
        allowed, arguments = node_limits(name)
        assert limits(urdf(**arguments)) == pytest.approx(allowed), name


def test_description_and_controllers_name_the_same_joint():
    description = urdf()
    system = description.find('ros2_control')
    assert system.get('name') == 'mlmem_hardware', 'a node of the name /mlmem is the element'
    controllers = yaml.safe_load((FOLDER / 'controllers.yaml').read_text())
    strain = controllers['strain_controller']['ros__parameters']
    (joint,) = system.findall('joint')
    (moved,) = description.findall('joint')
    assert strain['joints'] == [joint.get('name')] == [moved.get('name')]
    offered = {
        kind: [each.get('name') for each in joint.findall(f'{kind}_interface')]
        for kind in ('command', 'state')
    }
    assert strain['command_interfaces'] == offered['command']
    assert set(strain['state_interfaces']) <= set(offered['state'])
    started = set(controllers['controller_manager']['ros__parameters']) - {'update_rate'}
    assert started == {'joint_state_broadcaster', 'strain_controller'}


EVERY = 25
"""Ticks from one joint state to the next."""


@pytest.fixture(scope='module')
def given():
    """An element written by strain, which its joint shows."""
    return {'write.method': 'strain', 'publish.joint_states_every': EVERY}


@pytest.fixture
def description(memory):
    """The robot description of the module's element."""
    return urdf(element=memory.element, cells=load_element(QUICK['element']).design.N)


class Hardware:
    """What joint_state_topic_hardware_interface does with its two topics."""

    def __init__(self, robot, description):
        given = {each.get('name'): each.text for each in description.iter('param')}
        self._joint = description.find('ros2_control/joint').get('name')
        self._threshold = float(given['trigger_joint_command_threshold'])
        self.position = 0.0
        self.heard = self.sent = 0
        self._publisher = robot.node.create_publisher(JointState, given['joint_commands_topic'], 1)
        robot.node.create_subscription(JointState, given['joint_states_topic'], self._read, 5)
        robot.wait(lambda: self._publisher.get_subscription_count(), 'the node')

    def _read(self, message):
        self.position = message.position[message.name.index(self._joint)]
        self.heard += 1

    def write(self, position):
        if not abs(self.position - position) <= self._threshold:  # NaN is sent
            self._publisher.publish(JointState(name=[self._joint], position=[position]))
            self.sent += 1


def test_joint_command_moves_the_joint_within_its_limits(robot, description):
    """A command of the position where the joint is is not sent."""
    hardware, limit = Hardware(robot, description), limits(description)[1]
    for position in (limit, 0.0):
        hardware.write(position)
        robot.wait(lambda: abs(hardware.position - position) < 1e-9, 'the position')  # noqa: B023
        hardware.write(position)
    assert hardware.sent == 2


@pytest.mark.parametrize(
    ('level', 'position'), [(3, math.nan), (5, 0.0)], ids=['no controller', 'at rest']
)
def test_control_loop_during_a_write_keeps_the_content(
    memory, robot, description, level, position
):
    """Its hardware interface writes every period, whatever the controllers do.

    Until one commands a position that is NaN. During a write the strain is not the one commanded,
    which is sent; and it may come after it, if the joint states of rest come late.
    """
    hardware = Hardware(robot, description)
    before = len(memory.output)
    robot.pause(True)
    written = robot.ask('write', level=level)
    arrived(memory)
    for _ in range(6):
        heard = hardware.heard
        memory.step(EVERY)
        robot.wait(lambda: hardware.heard > heard, 'its state')  # noqa: B023
        hardware.write(position)
        robot.get('target_level')  # the node has seen what was sent before
    robot.pause(False)
    robot.send_message('joint_commands', JointState(name=['substrate'], position=[position]))
    assert robot.answer(written).success
    assert hardware.sent
    robot.get('target_level')  # the node has seen what was sent before
    assert robot.latest('level').data == level
    rejected = 'joint_commands refused' in memory.output[before:]
    assert rejected == (position == 0.0), memory.output[before:]
