# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long a replay of a session is: as its records say, if they are plausible.

A session records a state hash at a fixed interval of ticks. So its records cannot lie far apart,
which tells a forged or damaged tick from one that was reached.
"""

from __future__ import annotations

import itertools

from ..bag.errors import BagError
from .data import SessionData
from .records import MOST_HASH_EVERY, Header

_HASHES_MISSING = 100  # missing in a row, at most: from damage or a slow disk


def longest_silence(header: Header) -> int:
    """Return the most ticks that may lie between two records of a session."""
    return min(_HASHES_MISSING * header.hash_every, MOST_HASH_EVERY)


def last_tick(session: SessionData, first: int, silence: int) -> int:
    """Return the tick before which a session ends.

    Args:
        session: What was recorded.
        first: The tick with which it begins.
        silence: The most ticks that may lie between two of its records.

    Raises:
        BagError: A record has a tick that was not reached, or is of another element.
    """
    hashed = [recorded.tick for recorded in session.hashes]
    ticks = sorted([first, *hashed, *(tick for tick, _ in session.stamped)])
    if ticks[0] < first:
        raise BagError(
            f'the records of a session must start at tick {first} or later; got {ticks[0]}'
        )
    for before, tick in itertools.pairwise(ticks):
        if tick - before > silence:
            raise BagError(
                f'a session must have a record every {silence} ticks (100 times '
                f'record.hash_every); got none between tick {before} and tick {tick}'
            )
    for recorded in session.hashes:
        if len(recorded.v) != session.design.N:
            raise BagError(
                f'the state hash of tick {recorded.tick} must have N = {session.design.N} '
                f'cells; got {len(recorded.v)}'
            )
    return max([first, *hashed, *(tick + 1 for tick, _ in session.stamped)])
