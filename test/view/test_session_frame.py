# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recorded session as it is sent to the page."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from page_browser import unpack_frame

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem_tools.view.about import ACTIVE_PHASE_COUNT, About
from mlmem_tools.view.session_frame import Columns, load_frame

DATA = Path(__file__).parent.parent / 'data'


@pytest.fixture(scope='module')
def life():
    return load_frame(DATA / 'life')


def test_session_lists_commands_and_outcomes(life):
    events = unpack_frame(life)[0]['events']
    asked = [event['text'] for event in events if event['kind'] == 'command']
    ended = [event['text'] for event in events if event['kind'] == 'outcome']
    assert asked == ['write 2', 'read', 'erase', 'read']
    assert ended == [f'{name.split()[0]} succeeded' for name in asked]


def test_configuration_is_sent_as_integers(life):
    """While level 2 is held the first 75 cells are active; an erased element has none."""
    head, body = unpack_frame(life)
    columns = np.frombuffer(body, dtype='<i2').reshape(len(head['t']), head['element']['rows'])
    written = next(event['t'] for event in head['events'] if event['text'] == 'write succeeded')
    held = columns[np.searchsorted(head['t'], written) - 1]
    assert abs(held[:65].mean() / ACTIVE_PHASE_COUNT - 1.0) < 0.01
    assert abs(held[85:].mean() / ACTIVE_PHASE_COUNT) < 0.01
    assert abs(columns[-1].mean() / ACTIVE_PHASE_COUNT) < 0.01


def test_long_session_is_thinned_out_evenly():
    columns = Columns(max_count=1000)
    for number in range(5000):
        columns.add(0.1 * number, number)
    assert 500 <= len(columns.t) <= 1000
    assert len(set(np.diff(columns.rows))) == 1
    assert columns.t[-1] > 0.1 * 4990


def test_cells_beyond_the_scale_are_clipped():
    field = np.full(CASE_II.N, CASE_II.D_s1)
    field[:3] = CASE_II.D_s2, 100.0, np.nan
    values = About(CASE_II, Settings(), '/mlmem').scale_field(SimpleNamespace(data=field))
    assert values[:4].tolist() == [ACTIVE_PHASE_COUNT, 32767, 0, 0]
