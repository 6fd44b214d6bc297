# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Keep the books of seven fast steps on a substrate of springs, where the pages' are rigid.

.venv/bin/python lab/tools/elastic_energy.py
"""

import argparse
from dataclasses import replace

from mlmem_lab.paper.meter import fit_meter
from mlmem_lab.results import FOLDER, save
from mlmem_ros.device import Write, new_element, preset
from mlmem_ros.device.moves import paper_way
from mlmem_ros.physics import level_of


def main() -> None:
    """Write level 0, then 7, and save what the steps took."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    design, settings = preset('fast')
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
    level = heat / (design.levels - 1)
    result = {'s_min': design.s_min, 'fast': {'steps': steps, 'level': level}}
    save(FOLDER / 'elastic.json', result, 'lab/tools/elastic_energy.py', of=['fast'])
    print(result)


if __name__ == '__main__':
    main()
