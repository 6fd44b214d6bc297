# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is sent to a page: pictures of a running element, and a recorded session; and what the page
makes of words.
"""

import asyncio
import json
import random
from array import array
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from javascript import needs_node, run_module
from page_frame import unpack_frame

from mlmem import Settings
from mlmem.physics import CASE_II
from mlmem.readers.words import Code
from mlmem_tools import view
from mlmem_tools.view.about import ACTIVE_PHASE_COUNT, About
from mlmem_tools.view.frames import Pictures
from mlmem_tools.view.session_frame import Columns, load_frame

ABOUT = About(CASE_II, Settings(), '/mlmem')
ACTIVE = SimpleNamespace(data=array('f', [CASE_II.D_s2] * CASE_II.N))


def unpack_picture(frame):
    head, body = unpack_frame(frame)
    return head, np.frombuffer(body, '<i2')


def strained(strain):
    """Return the message of a substrate under a strain."""
    position = strain * CASE_II.N * Settings().scale.length
    return SimpleNamespace(name=['substrate'], position=[position])


async def collect_frames(messages):
    """Return every picture of messages by topic that come every 0.03 s, and the history."""
    pictures, frames = Pictures(asyncio.get_running_loop(), lambda: None), []
    for step, named in enumerate(messages):
        pictures.clock = 0.03 * step
        for name, message in named.items():
            pictures.take_message(name, message)
        frames.append(pictures.make_picture(ABOUT, {}))
    return frames, unpack_picture(pictures.pack_history())


@pytest.mark.parametrize('fields', [{'field': ACTIVE}, {}])
def test_picture_shows_strain_and_configuration(fields):
    """A real element publishes no configuration."""
    messages = [{'joint_states': strained(0.02), **fields}]
    (frame,), (history, columns) = asyncio.run(collect_frames(messages))
    head, column = unpack_picture(frame)
    assert head['strain'] == pytest.approx(0.02)
    assert history['strain'] == [[head['t']], [head['strain']]]
    assert history['t'] == [head['t']] * len(fields)
    assert (column == ACTIVE_PHASE_COUNT).all()
    assert columns.tolist() == column.tolist()
    assert len(column) == CASE_II.N * len(fields)


def test_idle_element_is_shown_rarely_a_change_at_once():
    """What held still meanwhile is told by its end, or a line would lead to the change."""
    messages = [{'field': ACTIVE, 'joint_states': strained(0.02)}] * 11
    messages.append({'field': ACTIVE, 'joint_states': strained(0.03)})
    frames, (history, _) = asyncio.run(collect_frames(messages))
    assert [step for step, frame in enumerate(frames) if frame is not None] == [0, 9, 11]
    head, _ = unpack_picture(frames[-1])
    assert head['strain'] == pytest.approx(0.03)
    assert head['held'] == pytest.approx(0.30)
    assert history['strain'][0] == pytest.approx([0.0, 0.24, 0.27, 0.30, 0.33])


def test_session_lists_events_and_configurations_as_integers():
    """While level 2 is held the first 75 cells are active; an erased element has none."""
    head, body = unpack_picture(load_frame(Path(__file__).parent.parent / 'data' / 'life'))
    events = head['events']
    asked = [event['text'] for event in events if event['kind'] == 'command']
    ended = [event['text'] for event in events if event['kind'] == 'outcome']
    assert asked == ['write 2', 'read', 'erase', 'read']
    assert ended == [f'{name.split()[0]} succeeded' for name in asked]
    columns = body.reshape(len(head['t']), head['element']['rows'])
    written = next(event['t'] for event in events if event['text'] == 'write succeeded')
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
    values = ABOUT.scale_field(SimpleNamespace(data=field))
    assert values[:4].tolist() == [ACTIVE_PHASE_COUNT, 32767, 0, 0]


@needs_node
def test_page_sets_walls_as_the_element_does():
    """In 8 levels, and in 16 at two or more apart."""
    script = Path(view.__file__).parent / 'static' / 'js' / 'words.js'
    source = (
        f"import {{ toggled, walls }} from '{script.as_uri()}';"
        + """
for (const [code, word, level] of JSON.parse(process.argv[1]))
  console.log(JSON.stringify([walls(word, code), toggled(word, level, code)]));
"""
    )
    chance, asked, expected = random.Random(5), [], []
    for code in (Code(8, 1), Code(16, 2)):
        tops = [b - a for a, b in pairwise((*code.single_wall_words, code.words))]
        told = {'tops': tops, 'spacing': code.spacing}
        for _ in range(40):
            word, level = chance.randrange(code.words), chance.randrange(code.levels)
            asked.append([told, word, level])
            expected.append((code, word, level))
    answers = run_module(source, json.dumps(asked))
    for (code, word, level), (found, toggled) in zip(expected, answers, strict=True):
        assert tuple(found) == code.walls(word)
        after = set(code.walls(toggled))
        assert (level in after) != (level in found)
        assert after - {level} <= set(found)
        if code.spacing == 1:
            assert after == set(found) ^ {level}
