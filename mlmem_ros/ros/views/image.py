# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rolling x-t contour of the configuration as an image, as in Fig. 4a."""

from __future__ import annotations

import array
import math

import numpy as np
from builtin_interfaces.msg import Time
from sensor_msgs.msg import Image

from ...device import MemoryElement
from ...host.settings import PublishSettings
from .palette import COLOURS, Palette

ROWS = 512
"""Greatest height; of a longer chain, only every second, third ... cell is shown."""

DEFECT_SHADE = 0.8
"""Brightness of the lines along the defects, where walls rest."""

EMPTY = 128
"""Grey of the time before the start."""


class Contour:
    """Site over time: site 1 at the bottom, now at the right, a thin line along every defect.

    A column is taken every few ticks, at almost no cost, so that late subscribers see the past,
    too; columns that fall into one run of ticks are equal. It is coloured only on demand.
    """

    def __init__(self, element: MemoryElement, settings: PublishSettings) -> None:
        self._element = element
        self._frame_id = settings.frame_id
        self._every = settings.column_every
        self._columns = settings.image_span // self._every
        self._palette = Palette(element.design)
        self._stride = math.ceil(element.design.N / ROWS)
        rows = len(range(0, element.design.N, self._stride))
        defects = [element.design.defect(level) - 1 for level in range(element.design.levels)]
        self._lines = rows - 1 - np.array(defects, dtype=np.intp) // self._stride
        # Column by column, and twice as wide as the image: each column is stored twice, one width
        # apart, so that the latest ones always lie side by side.
        self._indices = np.zeros((2 * self._columns, rows), dtype=np.uint8)
        self._taken = 0
        self._seen = (element.ticks - 1) // self._every

    def take(self) -> None:
        """Take the columns that were due since the last call: of a run at rest they are equal."""
        due = self._element.ticks // self._every - self._seen
        if due <= 0:
            return
        self._seen += due
        shown = self._element.chain.configuration[:: self._stride]
        places = (self._taken + np.arange(min(due, self._columns))) % self._columns
        column = self._palette.indices(shown[::-1])
        self._indices[places] = self._indices[places + self._columns] = column
        self._taken += len(places)

    def message(self, stamp: Time) -> Image:
        """Return the image of the latest columns."""
        begin = self._taken % self._columns
        pixels = COLOURS.take(self._indices[begin : begin + self._columns].T, axis=0)
        pixels[self._lines] = pixels[self._lines] * DEFECT_SHADE
        pixels[:, : max(0, self._columns - self._taken)] = EMPTY
        height, width, channels = pixels.shape
        image = Image(height=height, width=width, encoding='rgb8', step=width * channels)
        image.header.stamp = stamp
        image.header.frame_id = self._frame_id
        image.data = array.array('B', pixels.tobytes())
        return image
