# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The files for ros2_control agree with the node, which bears what a control loop sends.

There are no wheels of the controller manager and its controllers.
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
    actuator = settings.actuator
    elongation = settings.scale.length * design.end_displacement(1.0)
    far = actuator.max_strain * elongation
    fast = actuator.hand_rate_limit * elongation / settings.scale.time
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
    given = {each.get('name'): each.text for each in system.iter('param')}
    assert given['joint_commands_topic'] == '/mlmem/joint_commands'
    assert given['joint_states_topic'] == '/mlmem/joint_states'
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


GIVEN = {'write.method': 'strain'}
"""The joint shows the strain of a write."""


def joint_command(position):
    return JointState(name=['substrate'], position=[position])


def test_joint_commands_are_followed_up_to_the_limit(memory, robot):
    limit = limits(urdf(element=memory.element, cells=load_element(QUICK['element']).design.N))[1]
    for position in (limit, 0.0):
        robot.send_message('joint_commands', joint_command(position))
        reached = lambda state: abs(state.position[0] - position) < 1e-9  # noqa: B023, E731
        robot.next('joint_states', reached)


@pytest.mark.parametrize(
    ('level', 'position'), [(3, math.nan), (5, 0.0)], ids=['no controller', 'at rest']
)
def test_control_loop_during_a_write_keeps_the_content(memory, robot, level, position):
    """The hardware interface writes every period: NaN until a controller commands a position, and
    that position while the strain is another one, in a write.
    """
    before = len(memory.output)
    with robot.paused():
        written = robot.request('write', level=level)
        arrived(memory)
        for _ in range(6):
            robot.send_message('joint_commands', joint_command(position))
            robot.get('target_level')  # the node has seen what was sent before
            memory.step(25)
    assert robot.answer(written).success
    robot.send_message('joint_commands', joint_command(position))  # a period late
    robot.get('target_level')
    assert robot.latest('level').data == level
    rejected = 'joint_commands refused' in memory.output[before:]
    assert rejected == (position == 0.0), memory.output[before:]
