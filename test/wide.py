# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element whose words no integer of a message holds: a byte whose numbers are spread out.

What carries words is tested with it; the walls, and what they answer, are those of the byte.
"""

from functools import partial

from mlmem_ros.device import peeling, preset, words
from mlmem_ros.device.register import Content, Forecasts, Register
from mlmem_ros.device.words import Code
from mlmem_tools.view import about

BITS = 70
TOP = 1 << BITS
BYTE = preset('byte')


class WideCode(Code):
    """Words below 2^71: where a wall is, bit 70 is set as well."""

    @property
    def words(self):
        return 2 * TOP

    def walls(self, word):
        return super().walls(word % TOP % 256)

    def word(self, walls):
        return super().word(walls) + (TOP if walls else 0)

    def binary(self, word):
        return f'{word:0{BITS + 1}b}'


def of(walls):
    """Return the word of levels."""
    return WIDE.word(walls)


WIDE = WideCode(8, 1)


def wide(monkeypatch):
    """Let every byte made from now on hold such words."""

    def forecasts(known, design, settings):
        found = known(design, settings)
        made = Register.__new__(Register)
        contents = [WIDE.word(each.walls) for each in found.contents]
        contents = [Content(word, WIDE.walls(word), WIDE.binary(word)) for word in contents]
        Forecasts.__init__(made, contents, found.parts, found.listener)
        made.code = WIDE
        return made

    monkeypatch.setattr(peeling, 'reader', partial(forecasts, peeling.reader))
    monkeypatch.setattr(words, 'words_of', lambda *_: WIDE.words)
    monkeypatch.setattr(about, 'Code', lambda *_: WIDE)
