# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's parameters: a preset is the whole element, others override it."""

from dataclasses import asdict, replace

import pytest
import rclpy
import yaml
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.context import Context
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter
from robot import Robot

from mlmem import PRESETS, SettingsError, preset
from mlmem_ros.host.settings import declare_parameters
from mlmem_ros.parameter_file import format_preset


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


@pytest.mark.parametrize('name', PRESETS)
def test_a_preset_given_at_the_start_is_the_whole_element(declared, name):
    _, given = declared({'design.preset': name})
    assert (given.values().design, given.values().settings) == preset(name)


def test_a_parameter_given_beside_a_preset_overrides_it(declared):
    _, given = declared({'design.preset': 'bits_4', 'design.N': 216, 'write.hold': 60.0})
    design, settings = preset('bits_4')
    assert asdict(given.values().design) == {**asdict(design), 'N': 216}
    expected = settings.as_dict()
    expected['write']['hold'] = 60.0
    assert given.values().settings.as_dict() == expected


def test_a_double_may_come_as_the_text_that_ros2_param_load_makes_of_it(declared):
    """`ros2 param dump` writes 5.0e-05, and `load` reads that as the text 5e-05."""
    node, given = declared()
    assert set_all(node, {'actuator.max_rate': '5e-05'}).successful
    assert given.values().settings.actuator.max_rate == 5e-5
    for wrong in ('fast', 'nan', '1e300'):
        assert not set_all(node, {'actuator.max_rate': wrong}).successful
    assert given.values().settings.actuator.max_rate == 5e-5


def test_setting_a_preset_changes_all_its_settings(declared):
    """Also those that the preset before has changed."""
    node, given = declared()
    for name in PRESETS:
        assert set_all(node, {'design.preset': name}).successful
        assert (given.values().design, given.values().settings) == preset(name), name


def test_setting_a_preset_keeps_the_settings_of_the_robot(declared):
    node, given = declared({'scale.time': 1e-5, 'publish.frame_id': 'leg', 'design.N': 250})
    assert set_all(node, {'write.hold': 60.0}).successful
    assert set_all(node, {'design.preset': 'bits_4'}).successful
    assert given.values().design == preset('bits_4').design
    assert given.values().settings.write == preset('bits_4').settings.write
    assert given.values().settings.scale.time == 1e-5
    assert given.values().publish.frame_id == 'leg'


@pytest.mark.parametrize(
    ('namespace', 'frame'), [('', 'memory'), ('/bank/element_1', 'bank/element_1/memory')]
)
def test_elements_in_namespaces_have_separate_frames(declared, namespace, frame):
    _, given = declared(namespace=namespace)
    assert given.values().publish.frame_id == frame


@pytest.mark.parametrize('order', [1, -1])
def test_a_parameter_set_with_a_preset_overrides_it_in_any_order(declared, order):
    node, given = declared()
    both = [('design.preset', 'bits_4'), ('design.N', 216), ('write.hold', 60.0)]
    assert set_all(node, dict(both[::order])).successful
    assert given.values().design.N == 216
    assert given.values().settings.write.hold == 60.0
    assert given.values().settings.erase == preset('bits_4').settings.erase


@pytest.mark.parametrize('name', ['bits_7', '', 4, [1.5]])
def test_an_unknown_preset_changes_nothing(declared, name):
    node, given = declared({'design.preset': 'bits_2'})
    assert not set_all(node, {'design.preset': name, 'write.hold': 60.0}).successful
    assert (given.values().design, given.values().settings) == preset('bits_2')


def test_a_preset_is_set_only_while_unconfigured(declared):
    node, given = declared()
    given.lock(8)
    refused = set_all(node, {'design.preset': 'bits_4'})
    assert 'design.preset may be set only while the node is unconfigured' in refused.reason
    assert (given.values().design, given.values().settings) == preset('case_2')


def test_a_node_with_sixteen_levels(start):
    start({'design.preset': 'bits_4'})
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


@pytest.mark.parametrize('name', ['time.integrator', 'read.end'])
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
        (legal,) = robot.describe(['write.hold'])['write.hold'].floating_point_range
    assert {name for name, *_ in declare_parameters()} <= names
    assert (legal.from_value, legal.to_value) == (0.0, 1e6)


# --- a file that brings the element -----------------------------------------------------------


@pytest.fixture
def element(tmp_path):
    """A file of an element of 16 levels with one setting of its own."""
    design, settings = preset('bits_4')
    changed = replace(settings, write=replace(settings.write, hold=60.0))
    file = tmp_path / 'element.yaml'
    file.write_text(format_preset(design, changed), encoding='utf-8')
    return file


def dump(node):
    """Return what `ros2 param dump` saves, without rclpy's own."""
    names = set(node.list_parameters([], 0).names) - {
        'start_type_description_service',
        'use_sim_time',
    }
    return {name: node.get_parameter(name).value for name in sorted(names)}


def test_a_file_brings_the_element_and_a_dump_names_it(declared, element):
    node, given = declared({'design.file': str(element)})
    assert given.values().settings.write.hold == 60.0
    saved = dump(node)
    assert (saved['design.file'], saved['design.preset']) == (str(element), 'bits_4')
    again, same = declared(saved)
    assert (same.values().design, same.values().settings) == (
        given.values().design,
        given.values().settings,
    )
    assert dump(again)['design.digest'] == saved['design.digest'] != ''


def test_dump_of_a_default_node_starts_a_node_as_file(declared, tmp_path):
    """As a parameter file of its own, and as the file of its element."""
    node, given = declared()
    saved = dump(node)
    file = tmp_path / 'dump.yaml'
    file.write_text(yaml.safe_dump({'/memory': {'ros__parameters': saved}}), encoding='utf-8')
    for start in (saved, {'design.file': str(file)}):
        _, again = declared(start)
        assert again.values() == given.values()


def test_a_digest_tells_elements_apart(declared):
    node, _ = declared()
    digests = {dump(node)['design.digest']}
    for changed in ({'write.hold': 60.0}, {'design.N': 250}, {'design.preset': 'bits_1'}):
        assert set_all(node, changed).successful
        digests.add(dump(node)['design.digest'])
    assert len(digests) == 4
    assert 'is computed' in set_all(node, {'design.digest': 'x'}).reason
    assert set_all(node, dump(node)).successful  # as `ros2 param load` does


def test_a_dump_of_a_file_that_has_changed_is_warned_of(declared, element, capfd):
    declared({'design.file': str(element), 'design.digest': 'of another'})
    assert 'have the digest ' in capfd.readouterr().err


def test_a_preset_that_is_set_takes_the_place_of_a_file(declared, element):
    node, given = declared({'design.file': str(element)})
    assert set_all(node, {'design.preset': 'bits_1'}).successful
    assert (given.values().design, given.values().settings) == preset('bits_1')
    assert node.get_parameter('design.file').value == ''
    refused = set_all(node, {'design.file': str(element)})
    assert 'design.file may be set only at the start' in refused.reason


def test_a_dump_of_a_file_is_loaded_one_by_one_or_at_once(declared, element):
    """`ros2 param load` sets one by one, the preset after the file."""
    node, given = declared({'design.file': str(element)})
    saved = dump(node)
    for name, value in saved.items():
        assert set_all(node, {name: value}).successful
    assert set_all(node, saved).successful
    assert given.values().settings.write.hold == 60.0
    assert set_all(node, {'design.file': ''}).successful
    assert (given.values().design, given.values().settings) == preset('bits_4')


def test_a_dump_of_a_register_is_loaded_with_its_word(declared):
    """At the start, one by one and at once."""
    node, _ = declared({'design.preset': 'byte', 'target_word': 0xA8})
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
    node, _ = declared({'design.preset': name, fit: 5})
    assert f'{unfit} must be -1 (not set)' in set_all(node, {unfit: 5}).reason
    assert (node.get_parameter(unfit).value, node.get_parameter(fit).value) == (-1, 5)
    with pytest.raises(SettingsError, match=f'^{unfit} must be -1'):
        declared({'design.preset': name, unfit: 0})


def test_preset_of_the_other_kind_unsets_the_target(declared):
    node, given = declared({'target_level': 5})
    assert set_all(node, {'design.preset': 'byte'}).successful
    given.lock(256)
    assert node.get_parameter('target_level').value == -1


def test_a_file_that_brings_no_element_is_refused(declared, element, tmp_path):
    for file, why in ((tmp_path / 'none.yaml', 'No such file'), (tmp_path, 'Is a directory')):
        with pytest.raises(SettingsError, match=rf'parameter design\.file: .*{why}'):
            declared({'design.file': str(file)})
    with pytest.raises(SettingsError, match=r'must be that of design\.file, bits_4'):
        declared({'design.file': str(element), 'design.preset': 'bits_1'})


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
    assert {'target_level', 'design.preset', 'probe_right.v_th', 'faults.seed'} <= set(names)
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
    node, given = declared({'design.preset': 'case_2'})
    assert set_all(node, {'actuator.present': False}).successful
    with pytest.raises(SettingsError, match=r'write\.method must be kick or auto'):
        given.values()  # as configure does
    assert set_all(node, {'write.method': 'auto'}).successful
    assert not given.values().settings.actuator.present
    given.lock(8)  # as a configured node does
    refused = set_all(node, {'write.method': 'strain'})
    assert 'write.method must be kick or auto' in refused.reason
    assert set_all(node, {'write.method': 'kick'}).successful
