# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The files in `config` agree with the node: layouts for RViz, Foxglove and PlotJuggler, those for
ros2_control, and the SROS2 policy.

There are no wheels of the controller manager and its controllers.
"""

import contextlib
import json
import math
import re
import time
import xml.etree.ElementTree as ET
from fnmatch import fnmatchcase
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from nodes import QUICK, step_until_arrived
from sensor_msgs.msg import Image
from suite import TIMEOUT_S
from visualization_msgs.msg import MarkerArray

from mlmem import ELEMENT_NAMES, MemoryElement, Settings, load_element
from mlmem.physics import CASE_II
from mlmem_ros.contract.answers import RequestFailed, RequestRefused
from mlmem_ros.contract.requests import load_action_types
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.host.settings import PublishSettings
from mlmem_ros.ros.client.client import standalone
from mlmem_ros.ros.views import ChainMarkers

CONFIG = Path(__file__).parents[2] / 'config'
POLICY = ET.parse(CONFIG / 'sros2_policy.xml')
GIVEN = {'actions': True, 'write.method': 'strain'}
"""The joint shows the strain of a write."""

TYPES = {f'/mlmem/{name}': stream.kind for name, stream in STREAMS.items()}
TYPES['/diagnostics'] = DiagnosticArray


def test_rviz_config_names_topics_and_namespaces():
    config = yaml.safe_load((CONFIG / 'memory.rviz').read_text())['Visualization Manager']
    assert config['Global Options']['Fixed Frame'] == PublishSettings().frame_id
    kinds = {'MarkerArray': MarkerArray, 'Image': Image}
    for display in config['Displays']:
        assert TYPES[display['Topic']['Value']] is kinds[display['Class'].split('/')[1]]
    message = ChainMarkers(MemoryElement(CASE_II, Settings()), PublishSettings()).build_markers(
        Time()
    )
    shown = next(d['Namespaces'] for d in config['Displays'] if 'Namespaces' in d)
    assert shown == {marker.ns: True for marker in message.markers}


def test_foxglove_layout_names_topics_fields_and_services(robot):
    panels = json.loads((CONFIG / 'foxglove_layout.json').read_text())['configById']
    topics, services = set(), set()
    for panel in panels.values():
        paths = [path['value'] for path in panel.get('paths', ())] + [panel.get('path', '')]
        for path in filter(None, paths):  # such as `/diagnostics.status[0].values`
            topic, _, fields = path.partition('.')
            known = TYPES[topic].get_fields_and_field_types()
            assert re.match(r'\w+', fields)[0] in known, path
        topics |= set(panel.get('topics', ()))
        topics |= {panel.get('imageMode', {}).get('imageTopic'), panel.get('topicToRender')}
        services |= {panel['serviceName']} if 'serviceName' in panel else set()
    assert topics - {None} <= set(TYPES)
    robot.wait(
        lambda: services <= {name for name, _ in robot.node.get_service_names_and_types()},
        f'all of {sorted(services)}',
    )


def test_plotjuggler_layout_names_topics_and_series(robot):
    root = ET.parse(CONFIG / 'plotjuggler.xml').getroot()
    topics = root.find('Plugins/plugin/selected_topics').get('value').split(';')
    assert set(topics) <= set(TYPES)
    state, statuses = robot.next('joint_states'), robot.next('/diagnostics').status
    series = {'/mlmem/level/data', '/mlmem/range/range'}
    series |= {f'/mlmem/wall/data[{number}]' for number in range(2)}
    series |= {
        f'/mlmem/joint_states/{joint}/{value}'
        for joint in state.name
        for value in ('position', 'velocity', 'effort')
    }
    series |= {f'/diagnostics/{s.name}/{pair.key}' for s in statuses for pair in s.values}
    assert {curve.get('name') for curve in root.iter('curve')} <= series


def urdf(**arguments):
    """Return the robot description that xacro makes, by default of the preset of a robot."""
    xacro = pytest.importorskip('xacro')
    given = {name: str(value) for name, value in arguments.items()}
    path = CONFIG / 'ros2_control' / 'element.urdf.xacro'
    return ET.fromstring(xacro.process_file(str(path), mappings=given).toxml())


def limits(robot_description):
    """Return the limits of the joint: lower, upper, speed."""
    limit = robot_description.find('joint/limit')
    return [float(limit.get(name)) for name in ('lower', 'upper', 'velocity')]


@pytest.mark.parametrize('name', ELEMENT_NAMES)
def test_joint_limits_are_those_of_the_node(name):
    """Those of strain by hand, in m and m/s; by default those of the default element."""
    design, settings = load_element(name).design_and_settings
    arguments = {
        'cells': design.N,
        'length': settings.scale.length,
        'time': settings.scale.time,
        'max_strain': settings.actuator.max_strain,
        'hand_rate': settings.actuator.hand_rate_limit,
    }
    elongation = settings.scale.length * design.end_displacement(1.0)
    far = settings.actuator.max_strain * elongation
    fast = settings.actuator.hand_rate_limit * elongation / settings.scale.time
    for given in (arguments, {}) if name == 'case_2' else (arguments,):
        assert limits(urdf(**given)) == pytest.approx([-far, far, fast])


def test_description_and_controllers_name_the_same_joint():
    description = urdf()
    system = description.find('ros2_control')
    given = {each.get('name'): each.text for each in system.iter('param')}
    assert given['joint_commands_topic'] == '/mlmem/joint_commands'
    assert given['joint_states_topic'] == '/mlmem/joint_states'
    assert system.get('name') == 'mlmem_hardware', 'a node of the name /mlmem is the element'
    controllers = yaml.safe_load((CONFIG / 'ros2_control' / 'controllers.yaml').read_text())
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


def test_joint_commands_are_followed_up_to_the_limit(memory, robot):
    limit = limits(urdf(element=memory.element, cells=load_element(QUICK['element']).design.N))[1]
    for position in (limit, 0.0):
        robot.publish('joint_commands', name=['substrate'], position=[position])
        reached = lambda state: abs(state.position[0] - position) < 1e-9  # noqa: B023, E731
        robot.next('joint_states', reached)


@pytest.mark.parametrize(
    ('level', 'position'), [(3, math.nan), (5, 0.0)], ids=['no controller', 'at rest']
)
def test_control_loop_during_a_write_keeps_the_content(memory, robot, level, position):
    """The hardware interface writes every period: NaN until a controller commands a position, and
    that position while the strain is another one, in a write.
    """
    before, command = len(memory.output), {'name': ['substrate'], 'position': [position]}
    with robot.paused():
        written = robot.request('write', level=level)
        step_until_arrived(memory)
        for _ in range(6):
            robot.publish('joint_commands', **command)
            robot.get('target_level')  # the node has seen what was sent before
            memory.step(25)
    assert robot.answer(written).success
    robot.publish('joint_commands', **command)  # a period late
    robot.get('target_level')
    assert robot.latest('level').data == level
    rejections = [line for line in memory.output[before:].splitlines() if 'refused' in line]
    assert len(rejections) == (6 if position == 0.0 else 0), rejections
    assert all('joint_commands refused' in line and '2.25 m)' in line for line in rejections)


REQUESTS, REPORTS = {'send_goal', 'cancel_goal', 'get_result'}, {'feedback', 'status'}
ACTION = {
    'execute': {'reply': REQUESTS, 'publish': REPORTS},
    'call': {'request': REQUESTS, 'subscribe': REPORTS},
}
"""The parts of an action by role and rule."""

needs_interfaces = pytest.mark.skipif(
    not load_action_types() or find_spec('simulation_interfaces') is None,
    reason='actions or simulation_interfaces are not built: make interfaces',
)


def allowed(enclave, rule):
    """Return the full names that an enclave's only profile allows, as SROS2 expands them."""
    return listed(enclave, rule) | {
        f'{action}/_action/{part}'
        for role, parts in ACTION.items()
        for action in listed(enclave, role)
        for part in parts.get(rule, ())
    }


def listed(enclave, rule):
    """Return the full names that an enclave's only profile lists under a rule."""
    (profile,) = POLICY.iterfind(f'.//enclave[@path="{enclave}"]//profile')
    namespace = profile.get('ns').rstrip('/')
    names = [
        expression.text for group in profile for expression in group if group.get(rule) == 'ALLOW'
    ]
    assert len(names) == len(set(names)), 'a name is listed twice'
    return {name.replace('~', f'{namespace}/{profile.get("node")}', 1) for name in names}


def find_used_names(robot, node, expected):
    """Return the names that a node uses by rule, as soon as it uses those that are expected and
    none has been added for a second.
    """
    find = {
        'publish': robot.node.get_publisher_names_and_types_by_node,
        'subscribe': robot.node.get_subscriber_names_and_types_by_node,
        'reply': robot.node.get_service_names_and_types_by_node,
        'request': robot.node.get_client_names_and_types_by_node,
    }
    robot.wait(lambda: node in robot.node.get_node_names(), node)
    found, since = {}, time.monotonic()

    def has_settled():
        nonlocal found, since
        now = {rule: {name for name, _ in ask(node, '/')} for rule, ask in find.items()}
        if now != found or any(names - now[rule] for rule, names in expected.items()):
            found, since = now, time.monotonic()
        return time.monotonic() - since > 1.0

    robot.wait(has_settled, 'the whole graph')
    return found


@needs_interfaces
def test_policy_allows_what_the_node_does(robot):
    rules = ('publish', 'subscribe', 'reply', 'request')
    on_demand = {'/clock', '/mlmem/word'}  # of `use_sim_time` and of registers alone
    expected = {rule: allowed('/mlmem', rule) - on_demand for rule in rules}
    assert expected['request'] == set()  # it asks nobody
    assert find_used_names(robot, 'mlmem', expected) == expected


@needs_interfaces
def test_policy_allows_what_the_client_does(robot):
    with standalone(robot.element) as client:
        client.ready(TIMEOUT_S).wait()
        requests = [
            lambda: client.write(0),
            client.read,
            client.erase,
            client.calibrate,
            client.self_test,
            lambda: client.procedure('survey'),
            client.abort,
            lambda: client.pause(False),
            client.step,
            lambda: client.parameters('element'),
            lambda: client.set_parameters({'time.speed': 1.0}),
            lambda: client.follow([1.0], [0.0]),
            lambda: client.record(False),
        ]
        for request in requests:
            with contextlib.suppress(RequestFailed, RequestRefused):
                asked = request()
                client.abort().wait()  # what is asked counts, not how it ends
                asked.wait()
        expected = {rule: allowed('/mlmem_client', rule) for rule in ('request', 'publish')}
        expected['request'].discard('/mlmem/self_test')  # done by an action instead
        found = find_used_names(robot, client.node.get_name(), expected)
        assert found.items() >= expected.items()
        for service in found['reply']:
            assert any(fnmatchcase(service, known) for known in allowed('/mlmem_client', 'reply'))
    listens = {'alive', 'content', 'level', 'outcome', 'word'}
    topics = {f'/mlmem/{topic}' for topic in listens} | {'/diagnostics'}
    assert set(listed('/mlmem_client', 'subscribe')) == topics


def test_policies_of_client_and_node_agree():
    assert allowed('/mlmem_client', 'request') <= allowed('/mlmem', 'reply')
    assert allowed('/mlmem_client', 'subscribe') <= allowed('/mlmem', 'publish')
