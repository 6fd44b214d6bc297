# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The loop of the page in the tab against the product's, and what the page plays."""

import json
from pathlib import Path

import numpy as np
import pytest
from javascript import needs_node, run_module
from test_bits import case

from mlmem import load_element
from mlmem.physics import SUBSTEPS_PER_STEP
from mlmem_lab import tab_presets

FOLDER = Path(__file__).parents[2] / 'docs' / 'try'
RUN = """
import { readFileSync } from 'node:fs';
const [source, data] = process.argv.slice(1);
const { cells, steps, strain, shake, motion } = JSON.parse(readFileSync(data));
const url = 'data:text/javascript;base64,' + readFileSync(source).toString('base64');
const { Material } = await import(url);
const material = new Material(cells, steps);
material.V_N.set(strain);
material.shake.set(shake);
material.motion.set(motion[0]);
material.speeds.set(motion[1]);
const ends = material.advance(steps, { site: 1, driven: motion[0].length });
console.log(JSON.stringify([material.v, material.du, ...ends].map((row) => [...row])));
"""


@needs_node
def test_page_loop_moves_as_the_product(tmp_path):
    """Strained, shaken and driven, with a heavy and a stuck cell, for 300 steps of 67 cells.

    Only roundings differ: 1e-16 a step, which the motion amplifies a thousand times.
    """
    chain, (strain, held, shake) = case('rigid')
    case_file = tmp_path / 'case.json'
    steps = len(strain) // SUBSTEPS_PER_STEP
    case_file.write_text(json.dumps({
        'cells': tab_presets.describe_cells(chain), 'steps': steps, 'strain': strain.tolist(),
        'shake': shake.tolist(), 'motion': held.motion.tolist(),
    }))  # fmt: skip
    (told,) = run_module(RUN, FOLDER / 'material.js', case_file)
    left, right = chain.advance(strain, held, shake)
    for found, expected in zip(told, (chain.v, chain.velocity, left, right), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize(('name', 'start', 'target'), [('case_2', 3, 2), ('kick_2', 3, 1)])
def test_page_plays_what_the_instrument_does(name, start, target):
    known = json.loads((FOLDER / 'presets.json').read_text())[name]['ways']
    way = tab_presets.round_numbers(
        tab_presets.record_transition(load_element(name), start, target)
    )
    assert known[f'{start} {target}'] == json.loads(json.dumps(way))
