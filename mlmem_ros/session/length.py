# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The length of a session by its records, if they are plausible.

A session records a state hash at a fixed interval of ticks. So a record far from all others has a
forged or damaged tick.
"""

from __future__ import annotations

import itertools

from ..bag.errors import BagError
from .data import SessionData
from .records import MOST_HASH_EVERY, Header

_HASHES_MISSING = 100  # in a row, at most, because of damage or a slow disk


def longest_silence(header: Header) -> int:
    """Return the most ticks that may lie between two records of a session."""
    return min(_HASHES_MISSING * header.hash_every, MOST_HASH_EVERY)


def last_tick(session: SessionData, first: int, silence: int) -> int:
    """Return the tick before which a session ends.

    Args:
        session: The session.
        first: Its first tick.
        silence: The most ticks that may lie between two of its records.

    Raises:
        BagError: A record has an implausible tick, or belongs to another element; or the records
            are not in the order of their ticks.
    """
    hashed = [recorded.tick for recorded in session.hashes]
    commanded = [tick for tick, _ in session.stamped]
    for before, tick in itertools.chain(itertools.pairwise(hashed), itertools.pairwise(commanded)):
        if tick < before:
            raise BagError(
                f'the records of a session must be in the order of their ticks; got {tick} after '
                f'{before}: if the clock went back meanwhile, a copy sorted by time cannot be '
                'replayed, but the recorded bag can'
            )
    ticks = sorted([first, *hashed, *commanded])
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
    return max([first, *hashed, *(tick + 1 for tick in commanded)])
