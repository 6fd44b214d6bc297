# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The notebooks of the tutorials, and the full-size study of one."""

import json

import notebooks
import numpy as np
import pytest
from page import blocks

PRINTED = {0.0: ((39.1, 0.30), (40.9, 0.50)), 0.01: ((39.9, 0.34), (39.8, 0.51))}
"""Linear memory and NARMA2 error by scatter: blank, and with a wall at level 3."""

RESERVOIR = notebooks.TUTORIAL_FOLDER / 'reservoir.md'


@pytest.mark.parametrize('name', notebooks.NOTEBOOK_NAMES)
def test_notebook_has_the_code_of_its_page(name, tmp_path):
    notebooks.write_notebooks(tmp_path)
    notebook = json.loads((tmp_path / f'{name}.ipynb').read_text())
    code = [cell['source'] for cell in notebook['cells'] if cell['cell_type'] == 'code']
    page = [
        text
        for kind, text, _ in blocks(notebooks.TUTORIAL_FOLDER / f'{name}.md')
        if kind == 'python'
    ]
    assert code == [text.strip() for text in page]
    assert notebook['nbformat'] == 4
    assert not any('```python' in cell['source'] for cell in notebook['cells'])


@pytest.mark.slow
@pytest.mark.parametrize('scatter', [0.0, 0.01])
def test_reservoir_of_full_size_has_the_printed_table(scatter):
    """Tolerances are about the standard deviation between seeds: another BLAS rounds otherwise."""
    names = {}
    for text in [text for kind, text, _ in blocks(RESERVOIR) if kind == 'python'][:3]:
        exec(text, names)
    blank, wall, swapped = [], [], []
    for seed in range(3):
        memory, error, readout = names['measure'](None, seed, scatter)
        blank.append((memory, error))
        wall.append(names['measure'](3, seed, scatter)[:2])
        swapped.append(names['measure'](3, seed, scatter, weights=readout)[1])
    assert min(swapped) > 1.0
    for found, printed in zip((blank, wall), PRINTED[scatter], strict=True):
        memory, error = np.mean(found, axis=0)
        assert memory == pytest.approx(printed[0], abs=2.0)
        assert error == pytest.approx(printed[1], abs=0.05)
