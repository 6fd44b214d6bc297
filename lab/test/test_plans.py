# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plans of kicks, and of which preset a plan is."""

import numpy as np
from small_register import first_levels

from mlmem import MemoryElement, Write
from mlmem.element_file import Element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, draw_specimen
from mlmem_tools.identification import plan
from mlmem_tools.identification.plan import plan_pulses


def test_register_is_kicked_as_planned_for_its_cells(monkeypatch):
    """Alpha scattered by 1 %. With its twin's forecasts, but kicks as shipped, it writes 2 of 8
    words. The plan tries every third speed.
    """
    monkeypatch.setattr(plan, 'KICK_SPEEDS', plan.KICK_SPEEDS[::3])
    chosen = first_levels(3)
    design, settings = chosen.design_and_settings
    specimen = draw_specimen(design, Scatter(alpha=0.01), 0)
    found = plan_pulses(specimen, chosen)
    assert found.complete
    assert [len(found.steps), len(found.kinks), len(found.corrections.kinks)] == [3, 2, 3]
    known = Element(specimen, np.zeros(design.N), plan=found.corrections)
    written = {}
    for kicks in (settings, known.apply_planned_kicks(settings)):
        device = MemoryElement(
            design, kicks, driver=Simulation.build_blank(specimen, settings.time)
        )
        device.adopt_twin(specimen)
        outcomes = [device.perform(Write(word)) for word in range(device.reader.content_count)]
        written[kicks] = [outcome.success for outcome in outcomes].count(True)
    assert written[settings] <= 4
    assert written[known.apply_planned_kicks(settings)] == 8
