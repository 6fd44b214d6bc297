# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The golden sessions replay: recorded by a node in real time, run again without ROS.

    life            write 2, read, erase, come to rest, read
    manual_drive    write 0, then one level on by strain set by hand, read
    aborted_write   write 3, abort on the way, write 1, read

They were recorded with numpy 2.4 and numba 0.68 on a processor with AVX-512; a build that gives
other bits must still decode the same levels.
"""

from pathlib import Path

import pytest

from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_ros.testing import assert_replays

DATA = Path(__file__).parent.parent / 'data'


@pytest.mark.parametrize(
    ('bag', 'levels', 'done'),
    [
        ('life', [2, 2, -1], ['write', 'read', 'erase', 'read']),
        ('manual_drive', [0, 1], ['write', 'read']),
        ('aborted_write', [3, 3], ['write: aborted', 'abort', 'write', 'read']),
    ],
)
def test_golden_session_replays(bag, levels, done):
    session = assert_replays(DATA / bag)
    session.assert_levels(levels)
    assert session.report.hashes >= 2
    assert session.report.refused == []
    outcomes = [f'{each.procedure}: {each.error}' for each in session.report.outcomes]
    assert [each.removesuffix(': ') for each in outcomes] == done


def test_replay_says_where_and_by_how_much_it_differs():
    """Move the first command by one tick: the bits differ from the next hash on."""
    session = load_session(DATA / 'life')
    tick, command = session.stamped[0]
    session.stamped[0] = (tick + 1, command)
    report = run_replay(session)
    assert not report.exact
    assert report.first_difference == next(h.tick for h in session.hashes if h.tick > tick)
    # One tick later under the same ramp: the wall's cells lag by up to some tenths of a cell.
    assert 1e-9 < report.state_difference < 2.5
