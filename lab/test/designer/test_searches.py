# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search that found the shipped strokes and throws, repeated."""

import dataclasses
import functools
import math

import numpy as np
import pytest

from mlmem_lab.designer import stroke_search
from mlmem_lab.designer.stroke_search import (
    MoveTask,
    duration,
    inertia_over_mass,
    point,
    ring,
    stretched,
)
from mlmem_ros.device import preset
from mlmem_ros.device.move_settings import StrokeSettings, ThrowSettings

NOTHING = (0.0, 0.0)


def nearest_failure(fails, *radii):
    """Return the least radius of two changes at which something fails; infinity for none."""
    for radius in radii:
        if any(fails(off, seed) for seed, off in enumerate(ring(12, radius))):
            return radius
    return math.inf


@pytest.mark.slow
def test_a_shipped_stroke_is_found_from_the_closed_form():
    """A wall stays behind a fast substrate: its place X falls to X exp(-B / M e)."""
    pytest.importorskip('cmaes')
    design, settings = preset('bits_2')
    place = design.defect(3)
    rise = math.log(place / (place - design.J)) / inertia_over_mass(design)
    begin = StrokeSettings(
        ramp=200.0, hold=20.0, ease=100.0, ease_to=-0.5, release=400.0, settle=0.0,
        peak=-rise / 1.5,
    )  # fmt: skip
    task = MoveTask(design, (3,))
    found = stroke_search.search(task, begin, trials=90)
    closed_form, as_shipped, as_found = (
        nearest_failure(functools.partial(task.lost, move), 0.1, 0.2, 0.3)
        for move in (begin, settings.down_odd, found)
    )
    assert closed_form < as_shipped <= as_found
    assert task.cost(found) <= task.cost(settings.down_odd)


@pytest.mark.parametrize(
    'move', [StrokeSettings(ease=80.0, peak=-0.01), ThrowSettings(ease=60.0, peak=0.1)]
)
def test_a_point_is_a_cycle_of_whole_ticks_of_the_same_sign(move):
    assert point(move, np.zeros(7), 20.0) == move
    chance = np.random.default_rng(1)
    for _ in range(100):
        tried = point(move, chance.standard_normal(7), 20.0)
        assert all(time % 20.0 == 0.0 for time in (tried.ramp, tried.hold, tried.release))
        assert tried.peak * move.peak >= 0.0
        assert tried.settle == move.settle


def test_a_stretched_cycle_takes_as_much_longer():
    move = preset('case_2').settings.down_odd
    longer = stretched(move, 0.5, 2.0)
    assert duration(longer) == pytest.approx(2.0 * duration(move))
    assert longer.peak == 0.5 * move.peak


def test_a_lost_wall_costs_more_than_one_left_behind_and_that_more_than_a_success():
    design, settings = preset('bits_2')
    task, throw = MoveTask(design, (1, 3)), settings.throw
    weak, wild = stretched(throw, 0.1, 1.0), stretched(throw, 1.5, 0.3)
    lost = [task.lost(each, NOTHING, 0) for each in (throw, weak, wild)]
    assert lost == [0.0, pytest.approx(0.5), 1.0]


def test_a_stroke_is_judged_by_where_it_should_lead():
    design, settings = preset('bits_2')
    task = MoveTask(design, (3,))
    assert task.lost(settings.down_odd, NOTHING, 0) == 0.0
    assert task.lost(dataclasses.replace(settings.down_odd, levels=2), NOTHING, 0)
    assert not any(task.lost(settings.down_odd, off, 1) for off in ring(4, 0.1))
