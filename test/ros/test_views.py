# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The image and the markers."""

import dataclasses
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from robot import SENSOR, Robot
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import Image
from visualization_msgs.msg import Marker, MarkerArray

from mlmem import Outcome, Settings, Write, new_element
from mlmem.physics import CASE_II, find_walls
from mlmem_ros.host.settings import IMAGE_COLUMNS, PublishSettings
from mlmem_ros.ros.views import (
    BLUE,
    COLOUR_TABLE,
    MAX_IMAGE_ROWS,
    MAX_LABELS,
    MAX_SHOWN_CELLS,
    MAX_SHOWN_WALLS,
    RED,
    WHITE,
    ChainMarkers,
    Contour,
    Palette,
)

NOW = Time(sec=12, nanosec=34)


def run(element, command, contour):
    element.apply(command)
    while not any(isinstance(event, Outcome) for event in element.advance()):
        contour.take()
    contour.take()


@pytest.fixture(scope='module')
def written():
    """An element that holds level 1, and the contour of the writes."""
    element = new_element(CASE_II, Settings())
    contour = Contour(element, PublishSettings())
    for level in (0, 1):
        run(element, Write(level), contour)
    return element, contour


def still(design, configuration, *, V=0.0, ticks=0):
    """Return what the views read of an element, with a given state."""
    substrate = V * design.strain_shape
    chain = SimpleNamespace(configuration=configuration, v=configuration + substrate, V_N=V)
    return SimpleNamespace(
        design=design, chain=chain, ticks=ticks, computed=ticks, settings=Settings(),
        procedure='', reading=None, unknown=None,
    )  # fmt: skip


def with_wall(design, site):
    return np.where(design.sites <= site, design.D_s2, design.D_s1)


def pixels(image):
    assert (image.encoding, image.is_bigendian) == ('rgb8', 0)
    assert image.step == 3 * image.width
    return np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.width, 3)


# The image


def test_palette_runs_from_red_over_white_to_blue():
    palette = Palette(CASE_II)
    far = 10.0 * (CASE_II.D_s2 - CASE_II.D_s1)
    middle = 0.5 * (CASE_II.D_s1 + CASE_II.D_s2)
    low, between, high = COLOUR_TABLE[
        palette.colour_indices(np.array((-far, middle, far)))
    ].astype(int)
    assert tuple(low) == RED
    assert tuple(high) == BLUE
    assert abs(between - WHITE).max() <= 2
    (r1, _, b1), (r2, _, b2) = COLOUR_TABLE[
        palette.colour_indices(np.array((CASE_II.D_s1, CASE_II.D_s2)))
    ]
    assert r1 > b1
    assert b2 > r2


def test_last_column_of_the_image_is_the_configuration(written):
    element, contour = written
    contour = Contour(element, PublishSettings(image_span=1))
    contour.take()
    (column,) = pixels(contour.message(NOW)).transpose(1, 0, 2)
    expected = COLOUR_TABLE[Palette(element.design).colour_indices(element.chain.configuration)][
        ::-1
    ]
    defects = [
        element.design.N - element.design.defect_site(n) for n in range(element.design.levels)
    ]
    others = np.setdiff1d(np.arange(element.design.N), defects)
    assert (column[others] == expected[others]).all()
    assert (column[defects].sum(axis=1) < expected[defects].sum(axis=1)).all()


def test_image_columns_move_left_with_time():
    design = CASE_II
    element = still(design, with_wall(design, 0))
    contour = Contour(element, PublishSettings(image_span=50))
    images = []
    for tick in range(130):
        element.ticks = element.computed = tick
        element.chain.configuration = with_wall(design, tick)
        contour.take()
        images.append(pixels(contour.message(NOW)))
    assert images[0].shape == (225, 50, 3)
    for before, after in pairwise(images):
        assert (after[:, :-1] == before[:, 1:]).all()
        assert not (after[:, -1] == before[:, -1]).all()


def test_image_of_a_long_chain_stays_small():
    design = dataclasses.replace(CASE_II, N=5000, gamma=-1e-5)
    contour = Contour(still(design, with_wall(design, 2500)), PublishSettings(image_span=100_001))
    contour.take()
    shown = pixels(contour.message(NOW))
    assert shown.shape[0] <= MAX_IMAGE_ROWS
    assert shown.shape[1] <= IMAGE_COLUMNS
    blue = shown[:, -1, 2] > shown[:, -1, 0]
    assert blue.mean() == pytest.approx(0.5, abs=0.01)
    assert blue[-1]
    assert not blue[0]


# The markers


def by_namespace(message):
    found = {}
    for marker in message.markers:
        assert marker.header.frame_id == 'mlmem'
        assert marker.header.stamp == NOW
        if marker.action == Marker.ADD:
            found.setdefault(marker.ns, []).append(marker)
    assert len({marker.id for marker in message.markers}) == len(message.markers)
    return found


def test_markers_show_cells_wall_and_levels(written):
    element, _ = written
    found = by_namespace(ChainMarkers(element, PublishSettings()).message(NOW))
    (cells,), (wall,), (wall_label,), (title,) = (
        found[name] for name in ('cells', 'wall', 'wall label', 'level')
    )
    places = [point.x for point in cells.points]
    assert places == pytest.approx((element.design.sites + element.chain.v) * 0.01)
    blue = [colour.b > colour.r for colour in cells.colors]
    assert (len(blue), sum(blue)) == (225, pytest.approx(50, abs=2))
    (truth,) = find_walls(element.design, element.chain.configuration)
    assert wall.pose.position.x == pytest.approx(0.01 * truth.position)
    assert wall_label.text == f'wall {truth.position:.1f}'
    assert title.text == 'level 1 (001)'
    labels = {marker.text: marker.pose.position.x for marker in found['levels']}
    assert labels == {format(n, '03b'): pytest.approx(0.25 * (n + 1)) for n in range(8)}


def test_markers_of_former_walls_are_deleted():
    design = CASE_II
    element = still(design, with_wall(design, 100))
    markers = ChainMarkers(element, PublishSettings())
    assert len(by_namespace(markers.message(NOW))['wall']) == 1
    element.chain.configuration = with_wall(design, 0)
    assert 'wall' not in by_namespace(markers.message(NOW))
    element.chain.configuration = np.where(design.sites % 20 < 10, design.D_s1, design.D_s2)
    assert len(by_namespace(markers.message(NOW))['wall label']) == MAX_SHOWN_WALLS


def test_markers_of_a_long_chain_stay_few():
    design = dataclasses.replace(CASE_II, N=5000, gamma=-1e-5)
    element = still(design, with_wall(design, 2500))
    found = by_namespace(ChainMarkers(element, PublishSettings()).message(NOW))
    assert len(found['cells'][0].points) <= MAX_SHOWN_CELLS
    assert len(found['levels']) <= MAX_LABELS
    assert found['wall'][0].pose.position.x == pytest.approx(25.0, abs=0.01)


# The running node


def listen(robot, **kinds):
    """Subscribe to views as a tool does; return the messages by topic."""
    heard = {topic: [] for topic in kinds}
    for topic, kind in kinds.items():
        robot.node.create_subscription(kind, robot.name(topic), heard[topic].append, SENSOR)
    return heard


def test_node_publishes_views(robot):
    heard = listen(robot, image=Image, markers=MarkerArray)
    robot.wait(lambda: all(len(messages) > 2 for messages in heard.values()), 'both views')
    assert pixels(heard['image'][-1]).shape == (225, IMAGE_COLUMNS, 3)
    assert len(by_stamp := {str(image.header.stamp) for image in heard['image']}) > 2, by_stamp
    assert {marker.ns for marker in heard['markers'][-1].markers} >= {'cells', 'levels', 'wall'}
    for topic in heard:
        (info,) = robot.node.get_publishers_info_by_topic(robot.name(topic))
        assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE
        assert info.qos_profile.durability == DurabilityPolicy.VOLATILE


@pytest.mark.parametrize('views', [False, True])
def test_views_are_recorded_only_on_request(start, tmp_path, views):
    bag = tmp_path / 'session'
    parameters = {'record.path': str(bag), 'record.views': views}
    node = start(parameters, name='recorded')
    with Robot(node.element) as robot:
        heard = listen(robot, image=Image, markers=MarkerArray)
        robot.wait(lambda: all(heard.values()), 'both views')
        node.terminate()
        assert node.exit_status() == 0
    with AnyReader([bag]) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        assert ('/recorded/image' in counts) == views
        assert ('/recorded/markers' in counts) == views
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
    if views:
        assert counts['/recorded/image'] >= len(heard['image'])


def test_views_can_be_turned_off(start):
    off = {'publish.image_every': 0, 'publish.markers_every': 0}
    node = start({**off}, name='unseen')
    with Robot(node.element) as robot:
        heard = listen(robot, image=Image, markers=MarkerArray)
        walls = robot.received('wall')  # which are published as often
        robot.wait(lambda: len(walls) > 20, 'many walls')
        assert heard == {'image': [], 'markers': []}
