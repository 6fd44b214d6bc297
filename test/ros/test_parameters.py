# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's parameters and options: `element` names the element, few others override a value of
it; those of every ROS 2 node; starts that end for bad ones.
"""

from dataclasses import replace

import pytest
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_system_default
from service_msgs.msg import ServiceEventInfo
from std_srvs.srv import Trigger

from mlmem import ELEMENT_NAMES, Settings, SettingsError, element_file, load_element
from mlmem_ros import __version__
from mlmem_ros.host.settings import declare_parameters
from mlmem_ros.ros.main import parse_node_arguments
from mlmem_tools.cli.main import main as mlmem


def set_all(node, values):
    """Set parameters at once, as the service set_parameters_atomically does."""
    return node.set_parameters_atomically(
        [Parameter(name, value=value) for name, value in values.items()]
    )


@pytest.fixture
def file(tmp_path):
    """A file of an element of 16 levels with one setting of its own."""
    design, settings = load_element('bits_4').design_and_settings
    changed = replace(settings, write=replace(settings.write, hold=60.0))
    path = tmp_path / 'element.yaml'
    element_file.write_element_file(path, element_file.as_designed(design, changed))
    return path


def test_element_change_keeps_parameters_of_the_robot(declared):
    node, given = declared({'publish.frame_id': 'leg', 'write.attempts': 7})
    for name in ELEMENT_NAMES:
        design, settings = load_element(name).design_and_settings
        assert set_all(node, {'element': name}).successful
        assert given.values().design == design
        expected = replace(settings, write=replace(settings.write, attempts=7))
        assert given.values().settings == expected
        assert given.values().publish.frame_id == 'leg'


def test_overrides_of_an_element_file_default_to_it(declared):
    node, given = declared({'element': 'kick_4'})
    settings = load_element('kick_4').settings
    changed = {'write.attempts': 9, 'write.method': 'auto', 'read.end': 'both'}
    assert set_all(node, changed).successful
    write = replace(settings.write, attempts=9, method='auto')
    read = replace(settings.read, end='both')
    assert given.values().settings == replace(settings, write=write, read=read)
    defaults = {'write.attempts': 0, 'write.method': '', 'read.end': ''}
    assert set_all(node, defaults).successful
    assert given.values().settings == settings


def test_double_as_text_of_ros2_param_load_is_accepted(declared):
    """`ros2 param dump` writes 5.0e-05, and `load` reads that as the text 5e-05."""
    node, given = declared()
    for text, accepted in (('5e-05', True), ('fast', False), ('nan', False), ('-1e300', False)):
        assert set_all(node, {'faults.sensor_noise': text}).successful == accepted
        assert given.values().faults.sensor_noise == 5e-5


@pytest.mark.parametrize(
    ('namespace', 'frame'), [('', 'memory'), ('/bank/element_1', 'bank/element_1/memory')]
)
def test_elements_in_namespaces_have_separate_frames(declared, namespace, frame):
    _, given = declared(namespace=namespace)
    assert given.values().publish.frame_id == frame


def test_unknown_parameter_is_named_with_a_suggestion(declared):
    """rclpy says "Invalid access to undeclared parameter(s): []", and no more."""
    node, _ = declared()
    with pytest.raises(
        ParameterNotDeclaredException, match=r'time\.sped.; did you mean time\.speed'
    ):
        set_all(node, {'time.sped': 2.0})


def dump(node):
    """Return what `ros2 param dump` saves, without rclpy's own."""
    own = {'start_type_description_service', 'use_sim_time'}
    names = [
        name
        for name in node.list_parameters([], 0).names
        if not (name in own or name.startswith('qos_overrides.'))
    ]
    return {name: node.get_parameter(name).value for name in sorted(names)}


@pytest.mark.parametrize('levels', [16, 256])
def test_dump_starts_the_same_node_and_is_loaded_again(declared, file, levels):
    """Also while the node is configured; one by one and at once, as `ros2 param load` does."""
    given = {'element': str(file)} if levels == 16 else {'element': 'byte', 'target_word': 0xA8}
    node, first = declared(given)
    saved = dump(node)
    assert saved['target_word'] == given.get('target_word', -1)
    again, same = declared(saved)
    assert same.values() == first.values()
    assert dump(again) == saved
    same.lock_parameters()
    for values in (*({name: value} for name, value in saved.items()), saved):
        assert set_all(again, values).successful, values
        assert dump(again) == saved


@pytest.mark.parametrize(
    ('given', 'wrong'),
    [
        (
            {'element': 'bits_2'},
            [
                *(('element', value) for value in ('bits_7', '', '/nowhere/element.yaml', '/')),
                ('element', 4),
                ('element', [1.5]),
                ('target_level', 4),
            ],
        ),
        ({}, [('write.method', 'euler'), ('read.end', 'euler')]),
        ({'element': 'byte', 'target_word': 5}, [('target_level', 5)]),
        ({'target_level': 5}, [('target_word', 5)]),
    ],
    ids=str,
)
def test_value_that_is_no_choice_changes_nothing(declared, given, wrong):
    node, _ = declared(given)
    before = dump(node)
    for name, value in wrong:
        assert not set_all(node, {name: value, 'write.attempts': 7}).successful, value
        assert dump(node) == before
        with pytest.raises(SettingsError, match=name):
            declared({**given, name: value})


def test_dump_of_a_changed_file_gives_a_warning(declared, file, capfd):
    declared({'element': str(file), 'element_description': 'of another'})
    assert 'the element is not the one whose parameters were saved' in capfd.readouterr().err


def test_description_follows_the_element(declared):
    node, _ = declared({'element': 'bits_1'})
    before = node.get_parameter('element_description').value
    for text in ('', 'of another'):
        assert not set_all(node, {'element_description': text}).successful
    assert node.get_parameter('element_description').value == before
    assert set_all(node, {'element': 'bits_2'}).successful
    after = node.get_parameter('element_description').value
    assert element_file.parse(after, '').design == load_element('bits_2').design


def test_element_of_the_other_kind_unsets_the_target(declared):
    node, given = declared({'target_level': 5})
    assert set_all(node, {'element': 'byte'}).successful
    given.lock_parameters()
    assert node.get_parameter('target_level').value == -1


def test_parameters_have_unique_names_and_descriptions():
    """Few of them override a value of the element."""
    names, _, descriptions = zip(*declare_parameters(), strict=True)
    assert len(set(names)) == len(names)
    groups = tuple(f'{group}.' for group in Settings().list_groups())
    overrides = {'write.method', 'write.attempts', 'actuator.present', 'read.end', 'time.speed'}
    assert {name for name in names if name.startswith(groups)} == overrides
    assert all(description.text for description in descriptions)


def test_actuator_absent_with_method_strain_is_rejected(declared):
    node, given = declared({'element': 'case_2'})
    assert set_all(node, {'actuator.present': False}).successful
    with pytest.raises(SettingsError, match=r'write\.method'):
        given.values()  # as configure does
    assert set_all(node, {'write.method': 'auto'}).successful
    assert not given.values().settings.actuator.present
    given.lock_parameters()  # as a configured node does
    assert not set_all(node, {'write.method': 'strain'}).successful
    assert set_all(node, {'write.method': 'kick'}).successful


def test_qos_overrides_and_service_introspection_apply(start_robot):
    robot = start_robot({
        'qos_overrides./mlmem/field.publisher.depth': 7,
        'qos_overrides./mlmem/field.publisher.reliability': 'best_effort',
        'qos_overrides./mlmem/probe.subscription.depth': 9,
    })  # fmt: skip
    assert robot.get('qos_overrides./mlmem/probe.subscription.depth') == 9
    robot.wait(lambda: robot.node.count_publishers('/mlmem/field'), 'the publisher')
    (field,) = robot.node.get_publishers_info_by_topic('/mlmem/field')
    assert field.qos_profile.reliability.name == 'BEST_EFFORT'
    events = []
    robot.node.create_subscription(
        Trigger.Event, '/mlmem/read/_service_event', events.append, qos_profile_system_default
    )
    robot.trigger('read')
    assert not events
    robot.set(service_configure_introspection='contents')
    robot.wait(lambda: robot.node.count_publishers('/mlmem/read/_service_event'), 'a publisher')
    robot.trigger('read')
    kinds = ServiceEventInfo.REQUEST_RECEIVED, ServiceEventInfo.RESPONSE_SENT
    robot.wait(lambda: {each.info.event_type for each in events} >= set(kinds), 'both events')
    assert [each.response[0].success for each in events if each.response] == [True]


ROS = ['--ros-args', '--log-level', 'warn', '-p', 'time.speed:=7.0', '-r', '__node:=other']


@pytest.mark.parametrize('given', [ROS, [*ROS, '--'], []])
def test_options_of_ros_are_passed_on(given):
    assert parse_node_arguments(['node', *given]) == ['node', *given]


@pytest.mark.parametrize(
    ('given', 'word'),
    [
        (['--bogus'], '--bogus'),
        (['bogus'], 'bogus'),
        (['--vers'], '--vers'),
        (['--bogus', '--ros-args', '--'], '--bogus'),
        ([*ROS, '--', 'bogus'], 'bogus'),
    ],
    ids=str,
)
def test_unknown_option_is_rejected(given, word, capsys):
    with pytest.raises(SystemExit) as refused:
        parse_node_arguments(['node', *given])
    assert refused.value.code == 2
    assert word in capsys.readouterr().err


@pytest.mark.parametrize('of', [mlmem, lambda given: parse_node_arguments(['node', *given])])
def test_version_is_printed(of, capsys):
    with pytest.raises(SystemExit) as told:
        of(['--version'])
    assert told.value.code == 0
    assert capsys.readouterr().out == f'mlmem_ros {__version__}\n'


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({'element': 'case_3'}, ['element', "got 'case_3'"]),
        ({'target_level': 8}, ['target_level', 'from 0 to 7']),
        ({'faults.weak_cell': 300}, ['faults.weak_cell', 'N = 225']),
        ({'design.J': 300}, ['element', 'line 3', 'design.J', 'N - tail - 1']),
        ({'twin': '/nowhere.yaml'}, ['twin: /nowhere.yaml: ']),
        (
            {'device.driver': 'rig', 'device.retry': 1.0, 'device.address': 'slot 2'},
            ['device.address must be tcp://'],
        ),
        (
            {'device.driver': 'rig', 'device.address': 'tcp://127.0.0.1:1'},
            ['no rig at tcp://127.0.0.1:1'],
        ),
        ({'linger': 'strong'}, ['linger must be a double']),
        ({'linger': 1}, ['linger must be a double (a number with a decimal point)']),
        ({'write.attempts': 2.5}, ['write.attempts must be an integer']),
    ],
    ids=str,
)
def test_bad_parameter_ends_the_start(refused, given, words):
    line = refused({'design.check': 'skip'} | given)
    for word in ['cannot start', *words]:
        assert word in line


@pytest.mark.parametrize('text', ['/**:\n  ros__parameters:\n    write: {tension: 0.048\n', None])
def test_bad_parameter_file_ends_the_start(refused, tmp_path, text):
    file = tmp_path / 'given.yaml'
    if text:
        file.write_text(text)
    line = refused(file=file)
    assert str(file) in line
    assert not text or 'line 3' in line or 'line 4' in line


def test_unknown_ros_option_ends_the_start(refused):
    assert '--bogus' in refused(options=['--bogus'])
