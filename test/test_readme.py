# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The README is short and its links lead somewhere. Its commands are run by test/docs."""

import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
README = (ROOT / 'README.md').read_text(encoding='utf-8')

MOST_WORDS = 900


def test_it_is_short():
    assert len(README.split()) <= MOST_WORDS


def test_its_links_lead_somewhere():
    targets = re.findall(r'\]\(([^)#:]+)(?:#[^)]*)?\)', README)
    targets += re.findall(r'src(?:set)?="([^"]+)"', README)
    assert len(targets) > 10
    assert [path for path in targets if not (ROOT / path).exists()] == []


def test_its_two_commands_are_there():
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    commands = re.findall(r'^make (\w+)', README, re.MULTILINE)
    assert commands == ['demo', 'test']
    for command in commands:
        assert re.search(rf'^{command}:', makefile, re.MULTILINE), command
