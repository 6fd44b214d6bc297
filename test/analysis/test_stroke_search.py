# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Strokes and throws found by search, from what closed forms propose."""

import dataclasses
import itertools

import numpy as np
import pytest

from mlmem_ros.analysis.designer.cycle_search import ring
from mlmem_ros.analysis.designer.stroke_search import Task, duration, point, search, stretched
from mlmem_ros.analysis.moves_down import stroke_swing
from mlmem_ros.device import preset
from mlmem_ros.device.settings import StrokeSettings, ThrowSettings


def plain(design, start):
    """A stroke down of the swing that closed forms ask for, its times round."""
    peak = -stroke_swing(design, start, 1) / 1.5
    return StrokeSettings(
        ramp=200.0, hold=20.0, ease=100.0, ease_to=-0.5, release=400.0, settle=0.0, peak=peak
    )


@pytest.mark.slow
def test_a_shipped_stroke_is_found_again_from_the_closed_form():
    pytest.importorskip('cmaes')
    design, settings = preset('bits_2')
    task, begin = Task(design, (3,)), plain(design, 3)
    found = search(task, begin, trials=90)
    radii = (0.1, 0.2, 0.3)
    shipped = task.nearest_failure(settings.down_odd, radii)
    assert task.nearest_failure(begin, radii) < shipped
    assert task.nearest_failure(found, radii) >= shipped
    assert task.cost(found) <= task.cost(settings.down_odd)


@pytest.mark.parametrize(
    'swing', [StrokeSettings(ease=80.0, peak=-0.01), ThrowSettings(ease=60.0, peak=0.1)]
)
def test_a_point_is_a_cycle_of_whole_ticks_of_the_same_sign(swing):
    assert point(swing, np.zeros(7), 20.0) == swing
    chance = np.random.default_rng(1)
    for _ in range(100):
        tried = point(swing, chance.standard_normal(7), 20.0)
        assert all(time % 20.0 == 0.0 for time in (tried.ramp, tried.hold, tried.release))
        assert tried.peak * swing.peak >= 0.0
        assert tried.settle == swing.settle


def test_a_stretched_cycle_takes_as_much_longer():
    swing = preset('case_2').settings.down_odd
    longer = stretched(swing, 0.5, 2.0)
    assert duration(longer) == pytest.approx(2.0 * duration(swing))
    assert longer.peak == 0.5 * swing.peak


def test_what_loses_walls_costs_more_than_what_leaves_them_and_that_more_than_what_works():
    design, settings = preset('bits_2')
    task, throw = Task(design, (1, 3)), settings.throw
    weak, wild = stretched(throw, 0.1, 1.0), stretched(throw, 1.5, 0.3)
    lost = [task.lost(each, (0.0, 0.0), 0) for each in (throw, weak, wild)]
    assert lost == [0.0, pytest.approx(0.5), 1.0]
    assert task.nearest_failure(weak, (0.1,)) == 0.1


def test_a_stroke_is_judged_by_where_it_should_lead():
    design, settings = preset('bits_2')
    nothing = (0.0, 0.0)
    assert Task(design, (3,)).lost(settings.down_odd, nothing, 0) == 0.0
    assert Task(design, (3,)).lost(dataclasses.replace(settings.down_odd, levels=2), nothing, 0)
    around = list(itertools.islice(ring(4, itertools.repeat(0.1)), 4))
    assert not any(Task(design, (3,)).lost(settings.down_odd, off, 1) for off in around)
