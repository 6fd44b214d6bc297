# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's parameters: a preset is the whole element, others override it."""

from dataclasses import asdict
from types import SimpleNamespace

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from robot import Robot

from mlmem_ros.device import PRESETS, SettingsError, preset
from mlmem_ros.host import Journal
from mlmem_ros.ros.node.parameters import ParameterSet


@pytest.fixture(scope='module')
def context():
    context = Context()
    rclpy.init(context=context)
    yield context
    rclpy.try_shutdown(context=context)


@pytest.fixture
def declared(context):
    """Declare the parameters of a node that is given some: declared({'design.preset': 'fast'})."""
    nodes = []

    def declare(given=(), namespace=''):
        overrides = [Parameter(name, value=value) for name, value in dict(given).items()]
        node = Node('memory', namespace=namespace, context=context, parameter_overrides=overrides)
        nodes.append(node)
        host = SimpleNamespace(loop=None, element=None, journal=Journal(node.get_logger()))
        return node, ParameterSet(node, host)

    yield declare
    for node in nodes:
        node.destroy_node()


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


@pytest.mark.parametrize('name', PRESETS)
def test_setting_a_preset_changes_all_its_settings(declared, name):
    node, given = declared()
    assert set_all(node, {'design.preset': name}).successful
    assert (given.values().design, given.values().settings) == preset(name)


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
    start({'design.preset': 'bits_4', 'scale.time': 1e-5})
    with Robot() as robot:
        (levels,) = robot.describe(['target_level'])['target_level'].integer_range
        assert levels.to_value == 15
        assert robot.write(0)['code'] == '0000'
        assert robot.trigger('read')['end'] == 'right'


def test_the_interval_of_the_hashes_is_fixed_while_configured(declared):
    node, given = declared()
    given.lock(8)
    assert set_all(node, {'record.path': '/tmp/session'}).successful
    refused = set_all(node, {'record.hash_every': 30})
    assert 'record.hash_every may be set only while the node is unconfigured' in refused.reason


@pytest.mark.parametrize('name', ['time.integrator', 'read.end'])
def test_a_word_that_is_not_a_choice_is_refused(declared, name):
    node, _ = declared()
    refused = set_all(node, {name: 'euler'})
    assert refused.reason.startswith(f'{name} must be one of ')
    with pytest.raises(SettingsError, match=f"parameter {name} must be one of .*; got 'euler'"):
        declared({name: 'euler'})


# --- design.check ----------------------------------------------------------------------------


@pytest.mark.parametrize('word', [True, 0, 'off'])
def test_an_unknown_value_of_design_check_is_refused(declared, word):
    with pytest.raises(SettingsError, match=r'design\.check must be'):
        declared({'design.check': word})[1].values()
    node, given = declared()
    assert not set_all(node, {'design.check': word}).successful
    assert given.values().check == 'refuse'
