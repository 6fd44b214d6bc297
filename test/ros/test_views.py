# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The image and the markers."""

import dataclasses

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from nodes import end_node
from visualization_msgs.msg import Marker

from mlmem import MemoryElement, Settings, Write
from mlmem.physics import CASE_II, find_walls
from mlmem.readers.calibration import Calibration, DelayTable
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.host.settings import PublishSettings
from mlmem_ros.ros.views import COLOUR_TABLE, ChainMarkers, Contour, find_colours

NOW = Time(sec=12, nanosec=34)


def with_wall(design, site):
    return np.where(design.sites <= site, design.D_s2, design.D_s1)


def idle_element(design, site):
    """Return an unstrained element with a wall at a site; its calibration is not used."""
    table = DelayTable(tuple(np.arange(1.0, design.levels + 1.0)))
    element = MemoryElement(design, Settings(), Calibration(table, table))
    element.chain.place(with_wall(design, site))
    return element


def pixels(image):
    assert (image.encoding, image.is_bigendian) == ('rgb8', 0)
    assert image.step == 3 * image.width
    return np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.width, 3)


def by_namespace(message):
    found = {}
    for marker in message.markers:
        assert (marker.header.frame_id, marker.header.stamp) == ('mlmem', NOW)
        if marker.action == Marker.ADD:
            found.setdefault(marker.ns, []).append(marker)
    assert len({marker.id for marker in message.markers}) == len(message.markers)
    return found


def test_image_columns_are_configurations_and_move_left():
    """Cells next to no defect have the colour of the palette; defects are darker."""
    element = idle_element(CASE_II, 0)
    contour = Contour(element, 'mlmem', columns=50, every=1)
    defects = [CASE_II.N - CASE_II.defect_site(n) for n in range(CASE_II.levels)]
    others = np.setdiff1d(np.arange(CASE_II.N), defects)
    before = None
    for tick in range(130):
        element.ticks = tick
        element.chain.place(with_wall(CASE_II, tick))
        contour.take_columns()
        image = pixels(contour.build_image(NOW))
        assert image.shape == (225, 50, 3)
        colours = find_colours(element.chain.configuration, CASE_II)
        expected, column = COLOUR_TABLE[colours][::-1], image[:, -1]
        assert (column[others] == expected[others]).all()
        assert (column[defects].sum(axis=1) < expected[defects].sum(axis=1)).all()
        if before is not None:
            assert (image[:, :-1] == before[:, 1:]).all()
        before = image


def test_views_of_a_long_chain_stay_small():
    element = idle_element(dataclasses.replace(CASE_II, N=5000, gamma=-1e-5), 2500)
    contour = Contour(element, 'mlmem')
    contour.take_columns()
    shown = pixels(contour.build_image(NOW))
    assert shown.shape[0] <= 512
    assert shown.shape[1] <= 400
    blue = shown[:, -1, 2] > shown[:, -1, 0]
    assert blue.mean() == pytest.approx(0.5, abs=0.01)
    assert (blue[0], blue[-1]) == (False, True)
    found = by_namespace(ChainMarkers(element, PublishSettings()).build_markers(NOW))
    assert len(found['cells'][0].points) <= 500
    assert len(found['levels']) <= 32
    assert found['wall'][0].pose.position.x == pytest.approx(25.0, abs=0.01)


def test_markers_show_cells_wall_and_levels():
    element = MemoryElement(CASE_II, Settings())
    element.perform(Write(1))
    found = by_namespace(ChainMarkers(element, PublishSettings()).build_markers(NOW))
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
    element = idle_element(CASE_II, 100)
    markers = ChainMarkers(element, PublishSettings())
    assert len(by_namespace(markers.build_markers(NOW))['wall']) == 1
    element.chain.place(with_wall(CASE_II, 0))
    assert 'wall' not in by_namespace(markers.build_markers(NOW))
    stripes = CASE_II.sites % 20 < 10
    element.chain.place(np.where(stripes, CASE_II.D_s1, CASE_II.D_s2))
    assert len(by_namespace(markers.build_markers(NOW))['wall label']) == 4


def test_views_are_published_but_not_recorded(start_robot, tmp_path):
    bag = tmp_path / 'session'
    robot = start_robot({'record.path': str(bag)}, name='recorded')
    images, markers = robot.received('image'), robot.received('markers')
    robot.wait(lambda: len(images) > 2 and len(markers) > 2, 'both views')
    end_node(robot.memory)
    assert pixels(images[-1]).shape == (225, 400, 3)
    assert len({str(image.header.stamp) for image in images}) > 2
    assert {marker.ns for marker in markers[-1].markers} >= {'cells', 'levels', 'wall'}
    recorded = {topic.rpartition('/')[2] for topic in BagReader(bag).topics}
    assert {'level', 'image', 'markers'} & recorded == {'level'}


def test_views_can_be_turned_off(start_robot):
    robot = start_robot({'publish.views_every': 0}, name='unseen')
    images, markers = robot.received('image'), robot.received('markers')
    walls = robot.received('wall')  # which are published as often
    robot.wait(lambda: len(walls) > 20, 'many walls')
    assert images == markers == []
