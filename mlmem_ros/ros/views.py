# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Views for people, images and markers of a device; no topics here.

A configuration is coloured as in the paper: red for s1, blue for s2, white in between. `Contour`
is the rolling x-t contour of Fig. 4a, `ChainMarkers` the chain for RViz and Foxglove.
"""

from __future__ import annotations

import array
import math
from itertools import chain, zip_longest

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from sensor_msgs.msg import Image
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from mlmem import Array, Design, MemoryElement

from ..contract.streams import describe_content
from ..host.settings import COLUMN_PERIOD_TICKS, PublishSettings

RED, WHITE, BLUE = (178, 24, 43), (247, 247, 247), (33, 102, 172)

COLOUR_TABLE = np.stack(
    [
        np.interp(np.linspace(0.0, 2.0, 256), range(3), stop)
        for stop in np.array((RED, WHITE, BLUE), dtype=np.float64).T
    ],
    axis=1,
).astype(np.uint8)
"""Red, green and blue of every index, shape (256, 3)."""


def find_colours(configuration: Array, design: Design) -> np.ndarray:
    """Return the index in `COLOUR_TABLE` of each value, whose ends lie a little beyond the phases
    of the design.
    """
    overshoot = 0.2 * (design.D_s2 - design.D_s1)
    low, high = design.D_s1 - overshoot, design.D_s2 + overshoot
    index = (configuration - low) * (255.0 / (high - low))
    return np.clip(index, 0.0, 255.0).astype(np.uint8)


class Contour:
    """Site over time: site 1 at the bottom, now at the right, a thin line along every defect.

    A column is taken every few ticks, at almost no cost, so that late subscribers see the past,
    too; columns that fall into one run of ticks are equal. It is coloured only on demand.
    """

    def __init__(
        self,
        element: MemoryElement,
        frame_id: str,
        columns: int = 400,
        every: int = COLUMN_PERIOD_TICKS,
    ) -> None:
        """Show the last columns, of which one is taken every few ticks."""
        self._element = element
        self._frame_id = frame_id
        self._every = every
        self._columns = columns
        # of more than 512 rows, only every second, third ... cell is shown
        self._stride = math.ceil(element.design.N / 512)
        rows = len(range(0, element.design.N, self._stride))
        defects = [element.design.defect_site(level) - 1 for level in range(element.design.levels)]
        self._lines = rows - 1 - np.array(defects, dtype=np.intp) // self._stride
        self._indices = np.zeros((self._columns, rows), dtype=np.uint8)  # a ring of columns
        self._taken = 0
        self._seen = (element.ticks - 1) // self._every

    def take_columns(self) -> None:
        """Take the columns that were due since the last call: of a run at rest they are equal."""
        due = self._element.ticks // self._every - self._seen
        if due <= 0:
            return
        self._seen += due
        shown = self._element.chain.configuration[:: self._stride]
        column = find_colours(shown[::-1], self._element.design)
        for _ in range(min(due, self._columns)):
            self._indices[self._taken % self._columns] = column
            self._taken += 1

    def build_image(self, stamp: Time) -> Image:
        """Return the image of the latest columns."""
        oldest_first = np.roll(self._indices, -(self._taken % self._columns), axis=0)
        pixels = COLOUR_TABLE.take(oldest_first.T, axis=0)
        pixels[self._lines] = pixels[self._lines] * 0.8  # lines along the defects are darker
        pixels[:, : max(0, self._columns - self._taken)] = 128  # grey before the start
        height, width, channels = pixels.shape
        image = Image(height=height, width=width, encoding='rgb8', step=width * channels)
        image.header.stamp = stamp
        image.header.frame_id = self._frame_id
        image.data = array.array('B', pixels.tobytes())
        return image


class ChainMarkers:
    """The element along x, in metres, cell j at j lattice constants from the left end.

    Cells and defects are drawn where they are, moved by the strain and by their own displacement.
    The markers are created once and then only moved, because creation is costly.
    """

    def __init__(self, element: MemoryElement, settings: PublishSettings) -> None:
        design, self._unit = element.design, element.settings.scale.length
        self._element = element
        self._width = design.N * self._unit / 25.0  # length of the drawn chain over its width
        self._stride = math.ceil(design.N / 500)  # cells shown at most
        text = min(0.8 * self._width, 0.35 * design.J * self._unit)
        levels = range(0, design.levels, math.ceil(design.levels / 32))  # labelled at most
        self._defects = [design.defect_site(level) for level in levels]
        grey = ColorRGBA(r=0.55, g=0.55, b=0.55, a=1.0)
        orange = ColorRGBA(r=0.95, g=0.65, b=0.1, a=1.0)
        self._colours = [
            ColorRGBA(r=r / 255, g=g / 255, b=b / 255, a=1.0) for r, g, b in COLOUR_TABLE.tolist()
        ]

        self._substrate = _create_marker('substrate', Marker.CUBE, grey, y=0.25 * self._width)
        self._substrate.pose.position.z = -0.25 * self._width
        self._substrate.scale.z = 0.1 * self._width
        size, depth = 0.8 * self._stride * self._unit, 0.4 * self._width
        self._cells = _create_marker('cells', Marker.CUBE_LIST, grey, size, self._width, depth)
        shown = range(0, design.N, self._stride)
        self._cells.points = [Point() for _ in shown]
        below, above = -0.5 * self._width - 0.8 * text, self._width + 0.8 * text
        self._labels = [
            _create_text_marker('levels', design.code(level), grey, text, y=below)
            for level in levels
        ]
        bar = 0.03 * design.J * self._unit
        walls = 4  # shown at most: the memory has one, and a second during an erase
        self._walls = [
            _create_marker('wall', Marker.CUBE, orange, bar, 2 * self._width, 0.5 * self._width)
            for _ in range(walls)
        ]
        self._wall_labels = [
            _create_text_marker('wall label', '', orange, text, y=above) for _ in range(walls)
        ]
        self._title = _create_text_marker('level', '', orange, 1.5 * text, y=above + 1.8 * text)
        lists = self._labels, self._walls, self._wall_labels
        markers = [self._substrate, self._cells, *chain(*lists), self._title]
        self._message = MarkerArray(markers=markers)
        for number, marker in enumerate(self._message.markers):
            marker.id = number
            marker.header.frame_id = settings.frame_id

    def build_markers(self, stamp: Time) -> MarkerArray:
        """Return the markers of the present state; the next call changes them."""
        state, unit = self._element.chain, self._unit
        configuration, displacement = state.configuration, state.v
        substrate = displacement - configuration
        for marker in self._message.markers:
            marker.header.stamp = stamp

        length = (self._element.design.N + state.V_N) * unit
        self._substrate.pose.position.x = 0.5 * length
        self._substrate.scale.x = length
        shown = slice(None, None, self._stride)
        places = ((self._element.design.sites + displacement)[shown] * unit).tolist()
        for point, place in zip(self._cells.points, places, strict=True):
            point.x = place
        indices = find_colours(configuration[shown], self._element.design).tolist()
        self._cells.colors = [self._colours[index] for index in indices]
        for label, site in zip(self._labels, self._defects, strict=True):
            label.pose.position.x = (site + float(substrate[site - 1])) * unit

        found = self._element.walls.tolist()[: len(self._walls)]
        slots = zip(self._walls, self._wall_labels, strict=True)
        for (bar, label), position in zip_longest(slots, found):
            bar.action = label.action = Marker.DELETE if position is None else Marker.ADD
            if position is not None:
                place = (position + float(substrate[int(position) - 1])) * unit
                bar.pose.position.x = label.pose.position.x = place
                label.text = f'wall {position:.1f}'
        reading = self._element.reading
        code = f' ({reading.code})' if reading and reading.code else ''
        self._title.text = self._element.procedure or describe_content(self._element).text + code
        self._title.pose.position.x = 0.5 * length
        return self._message


def _create_marker(
    namespace: str, kind: int, colour: ColorRGBA, x: float = 0.0, y: float = 0.0, z: float = 0.0
) -> Marker:
    return Marker(ns=namespace, type=kind, color=colour, scale=Vector3(x=x, y=y, z=z))


def _create_text_marker(
    namespace: str, text: str, colour: ColorRGBA, height: float, y: float
) -> Marker:
    marker = _create_marker(namespace, Marker.TEXT_VIEW_FACING, colour, z=height)
    marker.text = text
    marker.pose.position.y = y
    return marker
