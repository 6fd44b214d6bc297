# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The words of the page are those of the element: both count sets of levels alike."""

import json
import random
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import pytest

import mlmem_tools
from mlmem.readers.words import Code

WORDS = Path(mlmem_tools.__file__).parent / 'view/static/js/words.js'
ASK = """
import { toggled, walls } from '%s';
for (const [code, word, level] of JSON.parse(process.argv[1]))
  console.log(JSON.stringify([walls(word, code), toggled(word, level, code)]));
"""


@pytest.mark.skipif(shutil.which('node') is None, reason='needs node')
def test_page_sets_walls_as_the_element_does():
    """In 8 levels, and in 16 at two or more apart."""
    chance, asked, expected = random.Random(5), [], []
    for code in (Code(8, 1), Code(16, 2)):
        tops = [b - a for a, b in pairwise((*code.each, code.words))]
        told = {'tops': tops, 'spacing': code.spacing}
        for _ in range(40):
            word, level = chance.randrange(code.words), chance.randrange(code.levels)
            asked.append([told, word, level])
            expected.append((code, word, level))
    script = ['node', '--input-type=module', '-e', ASK % WORDS.as_uri(), json.dumps(asked)]
    said = subprocess.run(script, capture_output=True, text=True, check=True, timeout=60)
    for (code, word, level), line in zip(expected, said.stdout.splitlines(), strict=True):
        found, toggled = json.loads(line)
        assert tuple(found) == code.walls(word)
        after = set(code.walls(toggled))
        assert (level in after) != (level in found)
        assert after - {level} <= set(found)
        if code.spacing == 1:
            assert after == set(found) ^ {level}
