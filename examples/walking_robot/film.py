# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A film of a day, drawn without a screen: the robot, what it says, and the byte in its memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hexapod import Hexapod
from PIL import Image, ImageDraw, ImageFont

PICTURE_WIDTH, PICTURE_HEIGHT, CAPTION_HEIGHT = 420, 210, 64
"""Of the robot's picture, and of what stands below it, in pixels."""

FRAME_PERIOD_S = 0.1
"""Seconds between two pictures."""

COLOUR_COUNT = 32
"""Of a picture."""

BIT_SIDE = 18
"""Side of the square of a bit in pixels."""


class Film:
    """Pictures of a body, saved as a GIF at the end of a `with` block."""

    def __init__(self, path: Path) -> None:
        """Begin a film; its file is written at its end."""
        self._path, self._frames = path, list[Any]()
        self._renderer: Any = None
        self._font = ImageFont.load_default(13)

    def __enter__(self) -> Film:
        return self

    def __exit__(self, kind: Any, *_: Any) -> None:
        if self._renderer is not None:
            self._renderer.close()
        if kind is None and self._frames:
            first, *others = self._frames
            first.save(
                self._path, save_all=True, append_images=others, loop=0, optimize=True,
                duration=round(1000 * FRAME_PERIOD_S),
            )  # fmt: skip

    def take_picture(self, body: Hexapod, said: str, word: int | None) -> None:
        """Take a picture if it is time for one; the word is None while it is not known."""
        if body.time < FRAME_PERIOD_S * len(self._frames):
            return
        if self._renderer is None:
            self._renderer = body.make_renderer(PICTURE_WIDTH, PICTURE_HEIGHT)
        frame = Image.new('RGB', (PICTURE_WIDTH, PICTURE_HEIGHT + CAPTION_HEIGHT), 'white')
        frame.paste(Image.fromarray(body.draw_picture(self._renderer)))
        draw = ImageDraw.Draw(frame)
        draw.text((12, PICTURE_HEIGHT + 8), f'{body.time:4.1f} s   {said}', 'black', self._font)
        draw.text((12, PICTURE_HEIGHT + 34), 'memory', 'black', self._font)
        for bit in range(8):
            left, top = 76 + (BIT_SIDE + 4) * bit, PICTURE_HEIGHT + 33
            stored = word is not None and word >> (7 - bit) & 1
            fill = '#2a5a9a' if stored else '#e8e8e8' if word is not None else 'white'
            draw.rectangle((left, top, left + BIT_SIDE, top + BIT_SIDE), fill, '#888888')
        what = 'not known' if word is None else f'{word:#04x}'
        draw.text((76 + (BIT_SIDE + 4) * 8 + 8, PICTURE_HEIGHT + 34), what, 'black', self._font)
        self._frames.append(frame.quantize(COLOUR_COUNT))
