# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search that made the shipped writes faster than the designer's rule, made again."""

import dataclasses

import numpy as np
import pytest

from mlmem_ros.analysis.designer import propose
from mlmem_ros.analysis.designer.cycle_search import Rows, schedule, search
from mlmem_ros.device import preset


def duration(write):
    return write.ramp + write.hold + write.ease + write.release + write.settle


@pytest.mark.parametrize(
    ('name', 'starts', 'trials'),
    [
        ('bits_2', (0, 1), 18),
        pytest.param('bits_4', (0, 1, 12), 135, marks=pytest.mark.slow),
    ],
)
def test_a_shipped_write_is_found_again_from_the_designers_rule(name, starts, trials):
    """In the same time per level, and as far from failure: the rule cut to it fails nearer by."""
    pytest.importorskip('cmaes')
    design, settings = preset(name)
    shipped, rows = settings.write, Rows(design, starts)
    rule = propose(design.levels).settings.write
    assert duration(rule) > duration(shipped)
    cut = schedule(rule, np.zeros(7), duration(shipped), 20.0)
    found = search(rows, rule, duration(shipped), tick=20.0, trials=trials)
    assert duration(found) == duration(cut) == duration(shipped)
    assert found.final_settle == rule.final_settle
    assert rows.nearest_failure(cut) < rows.nearest_failure(shipped)
    assert rows.nearest_failure(found) >= rows.nearest_failure(shipped)
    assert rows.cost(found) < rows.cost(cut)


def test_a_point_is_a_schedule_of_whole_ticks_and_of_its_time():
    begin = preset('bits_2').settings.write
    assert schedule(begin, np.zeros(7), duration(begin), 20.0) == begin
    chance = np.random.default_rng(1)
    for _ in range(100):
        write = schedule(begin, chance.standard_normal(7), 620.0, 20.0)
        times = [write.ramp, write.hold, write.ease, write.release]
        assert all(time % 20.0 == 0.0 for time in times)
        assert sum(times) == pytest.approx(620.0, abs=60.0)
        assert write.compression < 0.0 < write.tension


def test_what_loses_steps_costs_more_than_what_makes_them():
    design, settings = preset('bits_2')
    rows = Rows(design, (0,), 2)
    weak = dataclasses.replace(settings.write, tension=0.01)
    assert rows.cost(settings.write) < 1.0 < rows.cost(weak)
    assert rows.nearest_failure(weak) == 0.1
