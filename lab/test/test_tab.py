# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The product's loop in node.js: its bits; and what the page of the site plays."""

import json
import shutil
import subprocess
from pathlib import Path

import llvmlite.binding
import pytest
from test_bits import BITS, case

from mlmem import preset
from mlmem_lab.tab import presets, webassembly

FOLDER = Path(__file__).parents[2] / 'docs' / 'try'
NODE = shutil.which('node')
needs_node = pytest.mark.skipif(NODE is None, reason='node is not installed')

LLVM = (22, 1, 0)
"""Version that made the committed modules: another one may compile otherwise."""

RUN = """
const { readFileSync } = require('fs');
const [module, source, data] = process.argv.slice(1);
const { cells, steps, strain, shake, motion } = JSON.parse(readFileSync(data));
const url = 'data:text/javascript;base64,' + readFileSync(source).toString('base64');
import(url).then(async ({ Material, velocities }) => {
  const { instance } = await WebAssembly.instantiate(readFileSync(module));
  const material = new Material(instance.exports, cells, steps);
  material.V_N.set(strain);
  material.shake.set(shake);
  material.motion.set(motion[0]);
  material.motion.set(motion[1], velocities(steps));
  const ends = material.advance(steps, { site: 1, driven: motion[0].length });
  const hash = require('crypto').createHash('sha256');
  for (const row of [material.v, material.du, new Float64Array(cells.n), ...ends]) {
    hash.update(Buffer.from(row.buffer, row.byteOffset, row.byteLength));
  }
  console.log(hash.digest('hex').slice(0, 16), Math.max(...ends[1]));
});
"""


def in_node(module, tmp_path):
    """Return the bits of the case of test_bits.py in node, and the farthest of its right end."""
    chain, (strain, held, shake) = case('pefrl', 'rigid')
    case_file = tmp_path / 'case.json'
    steps = len(strain) // chain.integrator.substeps
    case_file.write_text(json.dumps({
        'cells': presets.describe_cells(chain), 'steps': steps, 'strain': strain.tolist(),
        'shake': shake.tolist(), 'motion': held.motion.tolist(),
    }))  # fmt: skip
    command = [NODE, '-e', RUN, FOLDER / module, FOLDER / 'material.js', case_file]
    told = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    bits, farthest = told.split()
    return bits, float(farthest)


@needs_node
def test_the_exact_loop_has_the_bits_of_the_product(tmp_path):
    """Strained, shaken and driven, with a heavy and a stuck cell, for 300 steps of 67 cells."""
    assert in_node('pefrl_exact.wasm', tmp_path)[0] == BITS['pefrl', 'rigid']


@pytest.mark.slow
@pytest.mark.skipif(llvmlite.binding.llvm_version_info != LLVM, reason='another LLVM')
def test_the_modules_are_those_of_their_command(tmp_path):
    webassembly.main(tmp_path)
    for name in webassembly.MODULE_NAMES.values():
        assert (tmp_path / name).read_bytes() == (FOLDER / name).read_bytes(), name


@pytest.mark.parametrize(('name', 'start', 'target'), [('case_2', 3, 2), ('kick_2', 3, 1)])
def test_the_page_plays_what_the_instrument_does_today(name, start, target):
    known = json.loads((FOLDER / 'presets.json').read_text())[name]['ways']
    way = presets.round_numbers(presets.record_transition(preset(name), start, target))
    assert known[f'{start} {target}'] == json.loads(json.dumps(way))
