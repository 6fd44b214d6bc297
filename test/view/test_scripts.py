# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the page makes of words, in Node.js: no browser is needed."""

import json
import random
from itertools import pairwise
from pathlib import Path

from javascript import needs_node, run_module

from mlmem.readers.words import Code
from mlmem_tools import view

SCRIPT = Path(view.__file__).parent / 'static' / 'js' / 'words.js'

ASK = """
import { toggled, walls } from '%s';
for (const [code, word, level] of JSON.parse(process.argv[1]))
  console.log(JSON.stringify([walls(word, code), toggled(word, level, code)]));
"""


@needs_node
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
    answers = run_module(ASK % SCRIPT.as_uri(), json.dumps(asked))
    for (code, word, level), (found, toggled) in zip(expected, answers, strict=True):
        assert tuple(found) == code.walls(word)
        after = set(code.walls(toggled))
        assert (level in after) != (level in found)
        assert after - {level} <= set(found)
        if code.spacing == 1:
            assert after == set(found) ^ {level}
