# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Other loops than the product's move as it does: in C, in the page of the tab, and by RK4 with
equations of its own.
"""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from javascript import needs_node, run_module
from test_bits import case

from mlmem import Settings, load_element
from mlmem.instrument.end import Pulse
from mlmem.physics import (
    CASE_II,
    SUBSTEPS_PER_STEP,
    Chain,
    HeldCell,
    Scatter,
    Specimen,
    draw_specimen,
)
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.stepping import substep_times
from mlmem_lab import tab_presets
from mlmem_lab.bench.kernel import build_chain, start_c_program
from mlmem_lab.rk4 import Rk4Element


@pytest.mark.skipif(shutil.which('gcc') is None, reason='gcc is missing')
def test_kernels_make_the_same_steps():
    chain = build_chain()
    advance, displacements = start_c_program()
    chain.advance_steps(200)
    advance(200)
    np.testing.assert_allclose(displacements, chain.v, rtol=0, atol=1e-12)


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


@pytest.mark.parametrize('relative', [False, True])
def test_rk4_element_agrees_with_the_chain(relative):
    """An echo of another integrator, another interpolation: 1e-4 of the pulse. It is fired while
    the strain rises.
    """
    dt, parts, pulse = 0.25, 4, Settings().probe  # parts: steps of a sample
    made = draw_specimen(CASE_II, Scatter(alpha=0.01, k_r=0.01, s=0.01, mass=0.003), 5)
    made = dataclasses.replace(made, damped_by_substrate=relative)
    ours = Rk4Element(made, dt, step=0.05)
    theirs = Chain(made, dt / parts)
    ours.v[:] = find_pinned_wall(made, 2)
    theirs.place(find_pinned_wall(made, 2))
    ends, sampled = [], dt * np.arange(1, 2401)
    for element, times in ((ours, sampled), (theirs, substep_times(2400 * parts, dt / parts))):
        motion = Pulse(element.end(1), pulse).evaluate_motion(times[times <= 12 * pulse.sigma])
        ends.append(element.advance(1e-4 * times, HeldCell(1, motion)))
    found, expected = ends[0], ends[1][:, parts - 1 :: parts]
    assert np.abs(expected - expected[:, :1]).max() > 5e-3  # it was probed
    assert found == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(('push', 'slides'), [(0.9e-5, False), (1.1e-5, True)])
def test_dry_friction_holds_against_a_smaller_force(push, slides):
    """All cells are pushed alike: off their ground state by push / k_s1."""
    uniform = Specimen(CASE_II, alpha_factor=1.0 / CASE_II.alpha)
    element = Rk4Element(uniform, 0.25, friction=1e-5)
    element.v[:] = CASE_II.D_s1 + push / CASE_II.k_s1
    before = element.v.copy()
    element.advance(np.zeros(4000))
    moved = np.abs(element.v - before).max()
    assert moved > 1e-6 if slides else moved < 1e-12
