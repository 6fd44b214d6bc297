# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the page makes of words and of a twin's diagnostics, in Node.js: no browser is needed."""

import json
import random
import shutil
from itertools import pairwise
from pathlib import Path

import pytest
from javascript import needs_node, run_module

from mlmem.readers.words import Code
from mlmem_ros.contract.answers import format_values
from mlmem_tools import view

SCRIPTS = Path(view.__file__).parent / 'static' / 'js'

pytestmark = needs_node

ASK = """
import { toggled, walls } from '%s';
for (const [code, word, level] of JSON.parse(process.argv[1]))
  console.log(JSON.stringify([walls(word, code), toggled(word, level, code)]));
"""


def test_page_sets_walls_as_the_element_does():
    """In 8 levels, and in 16 at two or more apart."""
    chance, asked, expected = random.Random(5), [], []
    for code in (Code(8, 1), Code(16, 2)):
        tops = [b - a for a, b in pairwise((*code.single_wall_words, code.words))]
        told = {'tops': tops, 'spacing': code.spacing}
        for _ in range(40):
            word, level = chance.randrange(code.words), chance.randrange(code.levels)
            asked.append([told, word, level])
            expected.append((code, word, level))
    answers = run_module(ASK % (SCRIPTS / 'words.js').as_uri(), json.dumps(asked))
    for (code, word, level), (found, toggled) in zip(expected, answers, strict=True):
        assert tuple(found) == code.walls(word)
        after = set(code.walls(toggled))
        assert (level in after) != (level in found)
        assert after - {level} <= set(found)
        if code.spacing == 1:
            assert after == set(found) ^ {level}


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
