# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Robot and memory in lockstep: a day with a fall, twice the same to the bit."""

import math
from importlib.util import find_spec

import pytest
from film import Film
from hexapod import GAITS, TIME_STEP_S, Hexapod
from PIL import Image
from walking_robot import MAX_FALLS, simulate_day

from mlmem_ros.session.data import load_session
from mlmem_ros.testing import assert_replays


@pytest.mark.parametrize('roughness', [0.0, 0.03])
def test_each_gait_walks_as_far_as_its_steps(roughness):
    """A foot is 0.22 m from its hip, and swings twice a step; stones and slips cost a part."""
    for gait in GAITS[1:]:
        body = Hexapod(roughness)
        for _ in range(round(4.0 / TIME_STEP_S)):
            body.step(gait)
        far, high = body.place
        reach = 4.0 * gait.frequency * 4 * 0.22 * math.sin(gait.stride)
        assert 0.5 * reach < far < 1.1 * reach
        assert high > 0.1  # on its feet


def test_without_power_it_lies_on_the_ground():
    body = Hexapod()
    body.powered = False
    for _ in range(round(1.0 / TIME_STEP_S)):
        body.step(GAITS[2])
    assert body.place[1] < 0.06


def test_a_film_has_a_picture_every_tenth_of_a_second(tmp_path):
    body = Hexapod()
    try:
        body.make_renderer(8, 8).close()
    except Exception as error:  # MuJoCo raises what its OpenGL raises
        pytest.skip(f'nothing draws here: {error}')
    with Film(tmp_path / 'film.gif') as film:
        for step in range(round(0.35 / TIME_STEP_S)):
            body.step(GAITS[1])
            film.take_picture(body, 'it walks', step)
    with Image.open(tmp_path / 'film.gif') as pictures:
        assert pictures.n_frames == 4
        assert len(pictures.convert('RGB').getcolors(1 << 20)) > 8  # not an empty scene


def test_a_day_goes_on_after_a_fall_and_is_the_same_again(tmp_path):
    days = [simulate_day(tmp_path / name) for name in ('first', 'second')]
    assert days[0] == days[1]
    assert [what for _, what in days[0].log] == [
        'the memory says stand: a new robot',
        'walk is written; falls: 0',
        'power is lost',
        'power is back',
        'the memory says walk; falls: 0',
        'walk is written; falls: 1',
    ]
    assert days[0].word == 1 * MAX_FALLS + 2
    first, second = (load_session(tmp_path / name) for name in ('first', 'second'))
    if find_spec('simulation_interfaces') is not None:  # or they begin at different ticks
        assert first.stamped == second.stamped
        hashes = [[(each.tick, each.hash) for each in bag.hashes] for bag in (first, second)]
        assert hashes[0] == hashes[1] != []
    assert_replays(tmp_path / 'first').assert_levels([0, 2, 2, MAX_FALLS + 2])
