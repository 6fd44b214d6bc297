# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a running element, from its messages."""

import asyncio
from array import array
from types import SimpleNamespace

import numpy as np
import pytest
from page_browser import unpack_frame

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem_tools.view.about import ACTIVE_PHASE_COUNT, About
from mlmem_tools.view.frames import Pictures

ABOUT = About(CASE_II, Settings(), '/mlmem')
LENGTH = CASE_II.N * Settings().scale.length
STRAINED = SimpleNamespace(name=['substrate'], position=[0.02 * LENGTH])
ACTIVE = SimpleNamespace(data=array('f', [CASE_II.D_s2] * CASE_II.N))


def unpacked(frame):
    head, body = unpack_frame(frame)
    return head, np.frombuffer(body, '<i2')


def taken(**messages):
    """Return a picture of messages by topic, and the history after it."""

    async def run():
        pictures = Pictures(asyncio.get_running_loop(), lambda: None)
        for name, message in messages.items():
            pictures.take_message(name, message)
        return unpacked(pictures.make_picture(ABOUT, {})), unpacked(pictures.pack_history())

    return asyncio.run(run())


@pytest.mark.parametrize('fields', [{'field': ACTIVE}, {}])
def test_picture_shows_strain_and_configuration(fields):
    """A real element publishes no configuration."""
    (head, column), (history, columns) = taken(joint_states=STRAINED, **fields)
    assert head['strain'] == pytest.approx(0.02)
    assert history['strain'] == [[head['t']], [head['strain']]]
    assert history['t'] == [head['t']] * len(fields)
    assert (column == ACTIVE_PHASE_COUNT).all()
    assert columns.tolist() == column.tolist()
    assert len(column) == CASE_II.N * len(fields)


def test_idle_element_is_shown_rarely_a_change_at_once():
    """What held still meanwhile is told by its end, or a line would lead to the change."""
    strained = SimpleNamespace(name=['substrate'], position=[0.03 * LENGTH])

    async def run():
        pictures, seen = Pictures(asyncio.get_running_loop(), lambda: None), []
        for step in range(12):
            pictures.clock = 0.03 * step
            pictures.take_message('field', ACTIVE)
            pictures.take_message('joint_states', strained if step == 11 else STRAINED)
            frame = pictures.make_picture(ABOUT, {})
            if frame is not None:
                head, _ = unpacked(frame)
                seen.append((step, head['strain'], head.get('held')))
        return seen, unpacked(pictures.pack_history())[0]['strain'][0]

    seen, history = asyncio.run(run())
    assert [step for step, *_ in seen] == [0, 9, 11]
    assert seen[-1][1] == pytest.approx(0.03)
    assert seen[-1][2] == pytest.approx(0.30)
    assert history == pytest.approx([0.0, 0.24, 0.27, 0.30, 0.33])
