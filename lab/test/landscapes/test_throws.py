# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Closed forms of throws, against the chain."""

import dataclasses

import pytest

from mlmem_lab.designer.stroke_search import reach, shortest_ease
from mlmem_ros.device import preset
from mlmem_ros.device.moves import throw_cycle
from mlmem_ros.device.reading import BLANK
from mlmem_ros.device.settings import ActuatorSettings
from mlmem_tools.checks.bare import moved


def thrown(name, level, *, ease=1.0, peak=1.0):
    design, settings = preset(name)
    throw = settings.throw
    throw = dataclasses.replace(throw, ease=throw.ease * ease, peak=throw.peak * peak)
    strong = ActuatorSettings(max_strain=0.5, max_rate=1.0)
    settings = dataclasses.replace(settings, throw=throw, actuator=strong)
    return moved(design, throw_cycle(settings, 0), level)


def test_a_throw_of_too_short_reach_leaves_the_wall_in_the_element():
    design, settings = preset('bits_4')
    change = (1.0 - settings.throw.ease_to) * settings.throw.peak
    slow = 0.85 * reach(design, change, settings.throw.ease)
    assert reach(design, change, slow * settings.throw.ease) < 1.3
    assert thrown('bits_4', 8) == BLANK
    assert thrown('bits_4', 8, ease=slow) != BLANK


@pytest.mark.parametrize(('over', 'found'), [(0.75, False), (1.15, True)])
def test_a_release_too_fast_for_the_far_end_blanks_nothing(over, found):
    design, settings = preset('bits_4')
    change = 1.5 * (1.0 - settings.throw.ease_to) * settings.throw.peak
    ease = over * shortest_ease(design, change) / settings.throw.ease
    assert (thrown('bits_4', 8, ease=ease, peak=1.5) == BLANK) is found
