# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The layouts for RViz, Foxglove and PlotJuggler name topics, fields and services that exist."""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import yaml
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from mlmem import MemoryElement, Settings
from mlmem.physics import CASE_II
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.host.settings import PublishSettings
from mlmem_ros.ros.views import ChainMarkers

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / 'config'
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


def assert_path_exists(path):
    """Assert that a path such as `/diagnostics.status[0].values` leads to a field."""
    topic, _, fields = path.partition('.')
    known = TYPES[topic].get_fields_and_field_types()
    assert re.match(r'\w+', fields)[0] in known, path


def test_foxglove_layout_names_topics_fields_and_services(robot):
    panels = json.loads((CONFIG / 'foxglove_layout.json').read_text())['configById']
    topics, services = set(), set()
    for panel in panels.values():
        paths = [path['value'] for path in panel.get('paths', ())] + [panel.get('path', '')]
        for path in filter(None, paths):
            assert_path_exists(path)
        topics |= set(panel.get('topics', ()))
        topics |= {panel.get('imageMode', {}).get('imageTopic'), panel.get('topicToRender')}
        services |= {panel['serviceName']} if 'serviceName' in panel else set()
    assert topics - {None} <= set(TYPES)

    def offered():
        return dict(robot.node.get_service_names_and_types())

    robot.wait(lambda: services <= set(offered()), f'all of {sorted(services)}')


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
