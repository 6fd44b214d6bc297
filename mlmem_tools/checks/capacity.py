# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many words an element holds: of one wall, and of many that kicks place.

Walls and kinks rest beside each other from a least distance on. It is found by trying: pairs at
every level, as many at a time as do not feel each other, and the densest words.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from mlmem.physics import Design, Specimen, StateError
from mlmem.readers.register import WALL_REACH_CELLS, pin_walls
from mlmem.readers.words import Code
from mlmem.settings import Settings


@dataclass(frozen=True)
class Capacity:
    """What an element holds in one way.

    Attributes:
        way: What writes it.
        distance: Least distance of two walls in levels; None if there is one wall, or none does.
        words: How many contents it tells apart, a blank element included.
        why: What is assumed, or why there are none.
    """

    way: str
    distance: int | None
    words: int
    why: str = ''

    @property
    def bits(self) -> float:
        """Information in a content."""
        return math.log2(self.words)

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON, whose readers keep no greater integers than 2^53."""
        words = self.words if self.words <= 2**53 else float(self.words)
        return {**asdict(self), 'words': words, 'bits': round(self.bits, 2)}


def list_capacities(design: Design, settings: Settings) -> Iterator[Capacity]:
    """Yield what an element holds by one wall, and by kicks."""
    yield Capacity('one wall', None, design.levels + 1)
    apart = next(
        # distances up to nine levels are tried
        (n for n in range(1, 10) if _can_hold_walls(design, n)),
        None,
    )
    reached = _count_reached(design, settings)
    assumed = '' if reached else 'if kicks reach every level'
    levels = reached or design.levels
    if apart is None:
        yield Capacity('kicks', None, 1, 'walls rest beside each other at no distance')
    else:
        if 0 < reached < design.levels:
            assumed = f'kicks reach {reached} of {design.levels} levels'
        yield Capacity('kicks', apart, Code(levels, apart).words, assumed)


def sample_words(design: Design, distance: int, top: int) -> Iterator[tuple[int, ...]]:
    """Yield words below a level that try a distance: the densest, and pairs of either kind, too
    far from each other to feel it.

    The highest wall is at an even level. With an odd distance, even and odd levels alternate.
    """
    last = top - 1 - (top - 1) % 2
    yield tuple(reversed(range(last, -1, -distance)))
    apart = distance + math.ceil(WALL_REACH_CELLS / design.J)
    period = distance + apart + (distance + apart) % 2
    for first in range(last, max(-1, last - period), -2):
        pairs = [
            n for high in range(first, distance - 1, -period) for n in (high, high - distance)
        ]
        if pairs:
            yield tuple(reversed(pairs))
        between = [high - apart - (apart + 1) % 2 for high in pairs]  # a kink above, a wall below
        if between and between[-1] >= 0:
            yield (*reversed(between), first)


def _count_reached(design: Design, settings: Settings) -> int:
    """Return to how many levels kicks send walls and kinks."""
    kick = settings.kick
    both = zip(kick.wall_speeds, kick.kink_speeds, strict=False)
    return min(design.levels, sum(1 for wall, kink in both if wall and kink))


def _can_hold_walls(design: Design, distance: int) -> bool:
    """Return whether walls rest at a distance, at every level."""
    made = Specimen(design)
    try:
        for top in (design.levels, design.levels - 1):
            for word in sample_words(design, distance, top):
                pin_walls(made, word)
    except StateError:
        return False
    return True
