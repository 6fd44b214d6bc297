# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the page makes of the twin in the diagnostics, in Node.js: no browser is needed."""

import json
import shutil
from pathlib import Path

import pytest
from javascript import needs_node, run_module

from mlmem_ros.contract.answers import format_values
from mlmem_tools import view

SCRIPTS = Path(view.__file__).parent / 'static' / 'js'

pytestmark = needs_node


def page(tmp_path, expression, part):
    """Return what functions of the page make of a part of the health."""
    shutil.copytree(SCRIPTS, tmp_path / 'js')
    (tmp_path / 'package.json').write_text('{"type": "module"}')
    script = (tmp_path / 'js' / 'twin.js').as_uri()
    (found,) = run_module(
        f"import {{ accused, compared, fitted }} from '{script}';\n"
        f'const part = {json.dumps(part)};\nconsole.log(JSON.stringify({expression}));\n'
    )
    return found


def test_alpha_is_shown_with_its_interval(tmp_path):
    values = format_values({'alpha': [1.01, 0.99], 'alpha_std': [0.001, 0.002]})
    shown, nothing = page(tmp_path, '[fitted(part), fitted({})]', values)
    site, alpha, high, low = shown
    assert site == [1, 2]
    assert alpha == pytest.approx([1.0, -1.0])
    assert high == pytest.approx([1.196, -0.608])
    assert low == pytest.approx([0.804, -1.392])
    assert nothing is None  # without a twin


def test_residual_is_described_in_words(tmp_path):
    values = format_values({'chi2': 1.234, 'residual_left': 1.1e-5, 'residual_right': 2e-5})
    words = "compared('as forecast', part)", "compared('as forecast', {})"
    said, none = page(tmp_path, f'[{", ".join(words)}]', values)
    assert said == 'as forecast; residual 1.1e-5 and 2.0e-5 cells at the ends, 1.2 per datum'
    assert none == 'no read compared yet'
