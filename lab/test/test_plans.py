# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans of strokes and throws, on an element whose cells scatter by 1 %, and of which preset."""

from dataclasses import replace

import numpy as np
import pytest
from small_register import first_levels

from mlmem_lab.plans import words
from mlmem_lab.plans.command import like
from mlmem_lab.plans.plan import ENOUGH, STROKE_PEAKS, plan, quick_moves, strokes
from mlmem_lab.twins.sensed import made
from mlmem_lab.windows.window import end
from mlmem_ros.device import Write, new_element
from mlmem_ros.device.drivers import Simulation
from mlmem_ros.device.moves import How, Move
from mlmem_ros.device.presets import Preset, preset
from mlmem_ros.device.reading import BLANK
from mlmem_ros.element_file import Element
from mlmem_ros.parameter_file import ParameterFileError
from mlmem_ros.physics import Scatter, scattered

DESIGN, SET = preset('case_2')
NOT_FROM = {
    'up_even': '0 2 4 6', 'up_odd': '1 3 5', 'down_even': '2 6', 'down_odd': '1 3 5',
    'throw': '0 1 2 3 5 6 7',
}  # fmt: skip
BARRED = {name: replace(getattr(SET, name), not_from=each) for name, each in NOT_FROM.items()}
CHOSEN = Preset(DESIGN, replace(SET, **BARRED))
"""With strokes down from 4 and 7 alone, and throws from 4."""

ELEMENT = made('case_2', 0.01, 0)


@pytest.fixture(scope='module')
def found():
    return {(each.kind, each.start): each for each in strokes(ELEMENT, CHOSEN)}


def test_an_element_of_several_presets_is_not_planned_by_a_guess():
    assert like(preset('kick_4').design) is preset('kick_4')  # damped otherwise than bits_4
    with pytest.raises(ParameterFileError, match='case_2, bits_3, fast, kick_3 have the levels'):
        like(DESIGN)


def test_an_ideal_element_uses_all_as_set():
    ideal = strokes(made('bits_2', 1e-9, 0), preset('bits_2'))
    assert [each.kind for each in ideal] == ['throw', 'throw', 'throw', 'down_odd', 'throw']
    assert quick_moves(ideal, preset('bits_2').settings) is None


def test_a_stroke_that_fails_as_set_gets_another_peak(found):
    stroke = found['down_odd', 7]
    chain = Simulation.of(ELEMENT, CHOSEN.settings.time).chain
    move = Move(How.STROKE, stroke.start, stroke.target, 0.0)
    ended = {
        peak: end(chain, CHOSEN.settings, move, {'peak': peak - 1.0})
        for peak in (1.0, 0.95 * stroke.peak, stroke.peak, 1.05 * stroke.peak)
    }
    assert ended.pop(1.0) != stroke.target
    assert set(ended.values()) == {stroke.target}
    assert stroke.peak in STROKE_PEAKS[1:]
    assert stroke.margin >= ENOUGH


def test_one_that_no_peak_saves_is_not_used(found):
    assert not found['down_even', 4].used
    quick = quick_moves(list(found.values()), CHOSEN.settings)
    assert 4 in quick.adapt(CHOSEN.settings).down_even.barred
    assert 4 not in CHOSEN.settings.down_even.barred


def test_a_register_is_kicked_as_planned_for_its_cells(monkeypatch):
    """Alpha scattered by 1 %. With its twin's forecasts, but kicks as shipped, it writes 2 of 8
    words. The plan tries every third speed.
    """
    monkeypatch.setattr(words, 'SPEEDS', words.SPEEDS[::3])
    design, settings = chosen = first_levels(3)
    specimen = scattered(design, Scatter(alpha=0.01), 0)
    found = plan(specimen, chosen)
    assert found.complete
    assert [len(found.steps), len(found.kinks), len(found.corrections.kinks)] == [3, 2, 3]
    known = Element(specimen, np.zeros(design.N), plan=found.corrections)
    written = {}
    for kicks in (settings, known.kicks(settings)):
        device = new_element(design, kicks, driver=Simulation.of(specimen, settings.time))
        device.adopt(specimen)
        outcomes = [device.perform(Write(word)) for word in range(device.words)]
        written[kicks] = [outcome.success for outcome in outcomes].count(True)
    assert written[settings] <= 4
    assert written[known.kicks(settings)] == 8


def test_a_throw_is_judged_with_its_own_peak(found):
    throws = [each for each in found.values() if each.kind == 'throw']
    barred = CHOSEN.settings.throw.barred
    assert {each.start for each in throws} == set(range(CHOSEN.design.levels)) - barred
    assert all(each.target == BLANK and each.peak == 1.0 for each in throws)
