# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The layouts for RViz, Foxglove and PlotJuggler name existing topics, in each tool's format.

The names of panels, displays and attributes are those of rviz2 in Jazzy, of Lichtblick,
Foxglove's open successor, and of PlotJuggler 3, looked up in their sources.
"""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from mlmem import Settings, new_element
from mlmem.physics import CASE_II
from mlmem_ros.contract import topics
from mlmem_ros.host.settings import PublishSettings
from mlmem_ros.ros.views import ChainMarkers

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / 'config'
TYPES = {f'/mlmem/{topic.name}': topic.kind for topic in topics.STREAM_TOPICS + topics.VIEW_TOPICS}
TYPES['/diagnostics'] = DiagnosticArray


def field_of(kind, path):
    """Follow a path such as `status[0].values` through a message type."""
    for name in re.findall(r'\w+', re.sub(r'\[[^\]]*\]', '', path)):
        fields = kind.get_fields_and_field_types()
        assert name in fields, f'{name} is no field of {kind.__name__}'
    return True


RVIZ = {  # plugins of rviz2 in Jazzy
    'rviz_common/Displays',
    'rviz_default_plugins/Image',
    'rviz_default_plugins/MarkerArray',
    'rviz_default_plugins/Measure',
    'rviz_default_plugins/MoveCamera',
    'rviz_default_plugins/Select',
    'rviz_default_plugins/TopDownOrtho',
}


def test_the_rviz_config():
    config = yaml.safe_load((CONFIG / 'memory.rviz').read_text())
    manager = config['Visualization Manager']
    parts = [*config['Panels'], *manager['Displays'], *manager['Tools']]
    assert {part['Class'] for part in [*parts, manager['Views']['Current']]} <= RVIZ
    assert manager['Global Options']['Fixed Frame'] == PublishSettings().frame_id
    kinds = {'MarkerArray': MarkerArray, 'Image': Image}
    for display in manager['Displays']:
        topic = display['Topic']
        assert TYPES[topic['Value']] is kinds[display['Class'].split('/')[1]]
        assert topic['Reliability Policy'] == 'Best Effort'
        assert topic['Durability Policy'] == 'Volatile'
    element = new_element(CASE_II, Settings())
    message = ChainMarkers(element, PublishSettings()).message(Time())
    shown = next(d['Namespaces'] for d in manager['Displays'] if 'Namespaces' in d)
    assert shown == {marker.ns: True for marker in message.markers}


FOXGLOVE = {  # panel types with their required settings
    '3D': {'cameraState', 'followMode', 'topics', 'layers', 'transforms', 'publish'},
    'CallService': {'serviceName', 'requestPayload'},
    'DiagnosticSummary': {'minLevel', 'pinnedIds', 'topicToRender', 'hardwareIdFilter'},
    'Image': {'imageMode'},
    'Indicator': {'path', 'style', 'rules', 'fallbackColor', 'fallbackLabel'},
    'Parameters': {'title'},
    'Plot': {'paths', 'xAxisVal', 'isSynced', 'showLegend', 'legendDisplay', 'sidebarDimension'},
    'StateTransitions': {'paths', 'isSynced'},
}


def leaves(node):
    if isinstance(node, str):
        return [node]
    assert set(node) == {'direction', 'first', 'second', 'splitPercentage'}
    assert node['direction'] in ('row', 'column')
    assert 0 < node['splitPercentage'] < 100
    return leaves(node['first']) + leaves(node['second'])


def offered(node):
    return set(dict(node.get_service_names_and_types_by_node('mlmem', '/')))


def test_the_foxglove_layout(robot):
    layout = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    assert set(layout) == {
        'configById',
        'globalVariables',
        'userNodes',
        'playbackConfig',
        'layout',
    }
    panels = layout['configById']
    assert sorted(leaves(layout['layout'])) == sorted(panels)
    topics, services = set(), set()
    for name, panel in panels.items():
        kind, _, identity = name.partition('!')
        assert identity
        assert FOXGLOVE[kind] <= set(panel), name
        paths = [path['value'] for path in panel.get('paths', ())] + [panel.get('path', '')]
        for path in filter(None, paths):
            topic, _, rest = path.partition('.')
            assert field_of(TYPES[topic], rest)
            topics.add(topic)
        topics |= set(panel.get('topics', ()))
        topics |= {panel['imageMode']['imageTopic']} if kind == 'Image' else set()
        topics |= {panel['topicToRender']} if 'topicToRender' in panel else set()
        services |= {panel['serviceName']} if kind == 'CallService' else set()
    assert topics <= set(TYPES)
    assert topics >= {'/mlmem/image', '/mlmem/markers', '/mlmem/level', '/diagnostics'}
    robot.wait(lambda: 'mlmem' in robot.node.get_node_names(), 'the node')
    # Its services are discovered one by one, after its name.
    robot.wait(lambda: services <= offered(robot.node), f'all of {sorted(services)}')


def test_the_plotjuggler_layout(robot):
    root = ET.parse(CONFIG / 'plotjuggler.xml').getroot()
    assert root.tag == 'root'
    (window,) = root.findall('tabbed_widget')
    assert window.attrib == {'name': 'Main Window', 'parent': 'main_window'}
    for tab in window.findall('Tab'):
        assert int(tab.get('containers')) == len(tab.findall('Container')) == 1
    for splitter in root.iter('DockSplitter'):
        assert splitter.get('orientation') in ('|', '-')
        sizes = [float(size) for size in splitter.get('sizes').split(';')]
        assert len(sizes) == int(splitter.get('count')) == len(splitter)
        assert sum(sizes) == pytest.approx(1.0)
    for plot in root.iter('plot'):
        assert plot.get('mode') == 'TimeSeries'
        assert plot.get('style') in ('Lines', 'Steps')
    curves = {curve.get('name') for curve in root.iter('curve')}
    topics = set(root.find('Plugins/plugin/selected_topics').get('value').split(';'))
    assert topics <= set(TYPES)
    assert curves <= set(series(robot))
    assert {name for name in topics if any(curve.startswith(name) for curve in curves)} == topics


def series(robot):
    """Yield the names that PlotJuggler gives to the node's values."""
    state = robot.next('joint_states')
    for joint in state.name:
        for value in ('position', 'velocity', 'effort'):
            yield f'/mlmem/joint_states/{joint}/{value}'
    for status in robot.next('/diagnostics').status:
        for pair in status.values:
            yield f'/diagnostics/{status.name}/{pair.key}'
    yield from ('/mlmem/level/data', '/mlmem/range/range')
    yield from (f'/mlmem/wall/data[{number}]' for number in range(2))


def test_every_layout_exists_and_is_documented():
    pages = [ROOT / 'docs' / name for name in ('view.md', 'robot.md')]
    told = ''.join(page.read_text(encoding='utf-8') for page in pages)
    for layout in ('memory.rviz', 'foxglove_layout.json', 'plotjuggler.xml', 'sros2_policy.xml'):
        assert (CONFIG / layout).is_file()
        assert layout in told, layout
