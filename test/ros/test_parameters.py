# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's parameters: `element` names the element, few others override a value of it."""

from dataclasses import replace

import pytest
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.context import Context
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter
from robot import Robot

from mlmem import PRESETS, Settings, SettingsError, element_file, preset
from mlmem_ros.host.settings import declare_parameters


@pytest.fixture(scope='module')
def context():
    context = Context()
    rclpy.init(context=context)
    yield context
    rclpy.try_shutdown(context=context)


def set_all(node, values):
    """Set parameters at once, as the service set_parameters_atomically does."""
    return node.set_parameters_atomically(
        [Parameter(name, value=value) for name, value in values.items()]
    )


@pytest.fixture
def file(tmp_path):
    """A file of an element of 16 levels with one setting of its own."""
    design, settings = preset('bits_4')
    changed = replace(settings, write=replace(settings.write, hold=60.0))
    path = tmp_path / 'element.yaml'
    element_file.write_element_file(path, element_file.as_designed(design, changed))
    return path


@pytest.mark.parametrize('name', PRESETS)
def test_shipped_name_at_the_start_is_the_whole_element(declared, name):
    _, given = declared({'element': name})
    assert (given.values().design, given.values().settings) == preset(name)
    assert given.values().specimen is None


def test_element_file_is_the_whole_element(declared, file):
    node, given = declared({'element': str(file)})
    assert given.values().design == preset('bits_4').design
    assert given.values().settings.write.hold == 60.0
    described = element_file.parse(node.get_parameter('element_description').value, 'it')
    assert described.settings == given.values().settings


def test_element_that_is_set_keeps_parameters_of_the_robot(declared):
    node, given = declared({'publish.frame_id': 'leg', 'write.attempts': 7})
    for name in PRESETS:
        design, settings = preset(name)
        assert set_all(node, {'element': name}).successful
        assert given.values().design == design
        expected = replace(settings, write=replace(settings.write, attempts=7))
        assert given.values().settings == expected
        assert given.values().publish.frame_id == 'leg'


def test_overrides_of_an_element_file_default_to_it(declared):
    node, given = declared({'element': 'kick_4'})
    settings = preset('kick_4').settings
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
    assert set_all(node, {'faults.sensor_noise': '5e-05'}).successful
    assert given.values().faults.sensor_noise == 5e-5
    for wrong in ('fast', 'nan', '-1e300'):
        assert not set_all(node, {'faults.sensor_noise': wrong}).successful
    assert given.values().faults.sensor_noise == 5e-5


@pytest.mark.parametrize(
    ('namespace', 'frame'), [('', 'memory'), ('/bank/element_1', 'bank/element_1/memory')]
)
def test_elements_in_namespaces_have_separate_frames(declared, namespace, frame):
    _, given = declared(namespace=namespace)
    assert given.values().publish.frame_id == frame


@pytest.mark.parametrize('name', ['bits_7', '', 4, [1.5], '/nowhere/element.yaml', '/'])
def test_element_that_there_is_not_changes_nothing(declared, name):
    node, given = declared({'element': 'bits_2'})
    assert not set_all(node, {'element': name, 'write.attempts': 7}).successful
    assert (given.values().design, given.values().settings) == preset('bits_2')


def test_element_is_set_only_while_unconfigured(declared):
    node, given = declared()
    given.lock(8)
    refused = set_all(node, {'element': 'bits_4'})
    assert 'element may be set only while the node is unconfigured' in refused.reason
    assert (given.values().design, given.values().settings) == preset('case_2')


def test_a_node_with_sixteen_levels(start):
    start({'element': 'bits_4'})
    with Robot() as robot:
        (levels,) = robot.describe(['target_level'])['target_level'].integer_range
        assert levels.to_value == 15
        assert robot.write(0)['code'] == '0000'
        assert robot.trigger('read')['end'] == 'right'


def test_the_interval_of_the_hashes_is_fixed_while_configured(declared, tmp_path):
    node, given = declared()
    given.lock(8)
    assert set_all(node, {'record.path': str(tmp_path / 'session')}).successful
    refused = set_all(node, {'record.hash_every': 30})
    assert 'record.hash_every may be set only while the node is unconfigured' in refused.reason


def test_what_a_configured_node_has_already_may_be_set(declared):
    """As `ros2 param load` does with what `ros2 param dump` wrote."""
    node, given = declared({'scale.time': 5e-5})
    given.lock(8)
    listed = node.list_parameters([], 0).names
    for name in listed:
        if name != 'start_type_description_service':  # rclpy's own, which is read-only
            value = node.get_parameter(name).value
            assert set_all(node, {name: value}).successful, name
    assert given.values().settings.scale.time == 5e-5


def test_an_unknown_parameter_is_named(declared):
    """rclpy says "Invalid access to undeclared parameter(s): []", and no more."""
    node, _ = declared()
    with pytest.raises(
        ParameterNotDeclaredException, match=r'time\.sped.; did you mean time\.speed'
    ):
        set_all(node, {'time.sped': 2.0})


@pytest.mark.parametrize('name', ['write.method', 'read.end'])
def test_a_word_that_is_not_a_choice_is_refused(declared, name):
    node, _ = declared()
    refused = set_all(node, {name: 'euler'})
    assert refused.reason.startswith(f'{name} must be one of ')
    with pytest.raises(SettingsError, match=f"parameter {name} must be one of .*; got 'euler'"):
        declared({name: 'euler'})


def test_a_node_declares_every_parameter_with_its_range(start):
    start({'autostart': False})
    with Robot() as robot:
        names = set(robot.parameters())
        (legal,) = robot.describe(['linger'])['linger'].floating_point_range
    assert {name for name, *_ in declare_parameters()} <= names
    assert (legal.from_value, legal.to_value) == (0.0, 3600.0)


# --- what `ros2 param dump` saves -----------------------------------------------------------


def dump(node):
    """Return what `ros2 param dump` saves, without rclpy's own."""
    names = set(node.list_parameters([], 0).names) - {
        'start_type_description_service',
        'use_sim_time',
    }
    return {name: node.get_parameter(name).value for name in sorted(names)}


def test_dump_starts_the_same_node(declared, file):
    node, given = declared({'element': str(file)})
    saved = dump(node)
    again, same = declared(saved)
    assert same.values() == given.values()
    assert dump(again) == saved


def test_dump_is_loaded_one_by_one_or_at_once(declared, file):
    node, given = declared({'element': str(file)})
    saved = dump(node)
    for name, value in saved.items():
        assert set_all(node, {name: value}).successful
    assert set_all(node, saved).successful
    assert given.values().settings.write.hold == 60.0


def test_description_follows_from_the_element_alone(declared):
    node, _ = declared()
    found = {dump(node)['element_description']}
    for name in ('bits_1', 'byte'):
        assert set_all(node, {'element': name}).successful
        found.add(dump(node)['element_description'])
    assert len(found) == 3
    refused = set_all(node, {'element_description': 'x'})
    assert refused.reason == 'element_description follows from element; set that one'


def test_dump_of_a_file_that_has_changed_is_warned_of(declared, file, capfd):
    declared({'element': str(file), 'element_description': 'of another'})
    assert 'the element is not the one whose parameters were saved' in capfd.readouterr().err


def test_a_dump_of_a_register_is_loaded_with_its_word(declared):
    """At the start, one by one and at once."""
    node, _ = declared({'element': 'byte', 'target_word': 0xA8})
    saved = dump(node)
    assert (saved['target_level'], saved['target_word']) == (-1, 0xA8)
    again, _ = declared(saved)
    assert dump(again) == saved
    for name, value in saved.items():
        assert set_all(again, {name: value}).successful
    assert set_all(again, saved).successful
    assert dump(again) == saved


@pytest.mark.parametrize(
    ('name', 'unfit', 'fit'),
    [('byte', 'target_level', 'target_word'), ('case_2', 'target_word', 'target_level')],
)
def test_target_of_the_other_kind_is_refused_by_name(declared, name, unfit, fit):
    node, _ = declared({'element': name, fit: 5})
    assert f'{unfit} must be -1 (not set)' in set_all(node, {unfit: 5}).reason
    assert (node.get_parameter(unfit).value, node.get_parameter(fit).value) == (-1, 5)
    with pytest.raises(SettingsError, match=f'^{unfit} must be -1'):
        declared({'element': name, unfit: 0})


def test_element_of_the_other_kind_unsets_the_target(declared):
    node, given = declared({'target_level': 5})
    assert set_all(node, {'element': 'byte'}).successful
    given.lock(256)
    assert node.get_parameter('target_level').value == -1


def test_file_that_is_no_element_is_refused(declared, tmp_path):
    for path, why in ((tmp_path / 'none.yaml', 'must be one of'), (tmp_path, 'Is a directory')):
        with pytest.raises(SettingsError, match=rf'^element.*{why}'):
            declared({'element': str(path)})


def test_error_in_an_element_file_names_the_line(declared, tmp_path):
    path = tmp_path / 'element.yaml'
    path.write_text('format: 1\nbased_on: case_2\nwrite:\n  hold: -1.0\n', encoding='utf-8')
    with pytest.raises(SettingsError, match=r'element\.yaml, line 4: write\.hold must be'):
        declared({'element': str(path)})


# --- design.check ----------------------------------------------------------------------------


@pytest.mark.parametrize('word', [True, 0, 'off'])
def test_an_unknown_value_of_design_check_is_refused(declared, word):
    with pytest.raises(SettingsError, match=r'design\.check must be'):
        declared({'design.check': word})[1].values()
    node, given = declared()
    assert not set_all(node, {'design.check': word}).successful
    assert given.values().check == 'refuse'


def test_a_parameter_without_a_name_is_refused(start, tmp_path):
    """rclpy takes it for a declared one of any type; with bytes no recording could begin."""
    node = start({'autostart': False})
    with Robot() as robot:
        for value in ([b'\1'], 3, True, 'x', [0.5]):
            result = robot.try_set('', value)
            assert not result.successful
            assert result.reason == "there is no parameter ''"
        robot.set(record__path=str(tmp_path / 'session'))
        for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
            request = ChangeState.Request(transition=Transition(id=transition))
            assert robot.response(robot.send('change_state', request, ChangeState)).success
        assert 'fault in the software' not in node.output


# --- every one is declared once, with a legal default ----------------------------------------


def test_every_parameter_has_a_unique_name_and_a_description():
    found = list(declare_parameters())
    names = [name for name, _, _ in found]
    assert len(set(names)) == len(names)
    assert {'target_level', 'element', 'faults.seed'} <= set(names)
    groups = tuple(f'{group}.' for group in Settings().groups())
    of_an_element = {name for name in names if name.startswith(groups)}
    assert of_an_element == {
        'write.method', 'write.attempts', 'actuator.present', 'read.end', 'time.speed',
    }  # fmt: skip
    assert all(description.text for _, _, description in found)


def test_every_default_is_legal():
    for name, default, description in declare_parameters():
        if description.low is not None:
            assert default >= description.low, name
        if description.high is not None:
            assert default <= description.high, name
        if description.choices:
            assert default in description.choices, name


def test_actuator_absent_with_method_strain_is_rejected(declared):
    node, given = declared({'element': 'case_2'})
    assert set_all(node, {'actuator.present': False}).successful
    with pytest.raises(SettingsError, match=r'write\.method must be kick or auto'):
        given.values()  # as configure does
    assert set_all(node, {'write.method': 'auto'}).successful
    assert not given.values().settings.actuator.present
    given.lock(8)  # as a configured node does
    refused = set_all(node, {'write.method': 'strain'})
    assert 'write.method must be kick or auto' in refused.reason
    assert set_all(node, {'write.method': 'kick'}).successful
