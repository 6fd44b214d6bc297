# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Keep the books of seven steps on a substrate of springs, where the pages' are rigid.

python3 -m mlmem_lab.elastic [PRESET] makes lab/results/elastic.json.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

from mlmem_ros.device import Write, new_element, preset
from mlmem_ros.device.moves import paper_way
from mlmem_ros.physics import level_of

from .paper.meter import fit_meter
from .results import run


def books(name: str) -> dict[str, Any]:
    """Write level 0, then the last, and return what the steps took."""
    design, settings = preset(name)
    design = replace(design, substrate='elastic')
    element = new_element(design, paper_way(settings))
    meter = fit_meter(element)
    element.perform(Write(0))
    before = meter.books()
    outcome = element.perform(Write(design.levels - 1))
    assert outcome.success, outcome.error
    assert level_of(design, element.chain.configuration) == design.levels - 1
    actuator, transducer, heat, stored = map(float, meter.books() - before)
    steps = {'actuator': actuator, 'transducer': transducer, 'heat': heat, 'stored': stored}
    return {'steps': steps, 'level': heat / (design.levels - 1), 's_min': design.s_min}


if __name__ == '__main__':
    sys.exit(run('elastic', __doc__, books, modules=['lab/mlmem_lab/paper/meter.py']))
