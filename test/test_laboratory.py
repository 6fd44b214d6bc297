# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The laboratory is a package of its own: it imports this one, and adds commands to `mlmem`."""

from importlib.metadata import EntryPoints
from pathlib import Path

import pytest

from mlmem_ros import packages
from mlmem_tools.cli import laboratory
from mlmem_tools.cli import main as cli

ROOT = Path(__file__).parent.parent


def test_command_without_the_laboratory_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr(packages, 'list_entry_points', EntryPoints)
    for name in laboratory.LABORATORY_COMMANDS:
        assert cli.main([name, '--json']) == 1
        told = capsys.readouterr().err
        assert f'mlmem {name}: the laboratory is missing' in told
        assert 'pip install' in told


@pytest.mark.parametrize(
    'words',
    [
        ['design', '--levels', '2'],
        ['design', 'prove', 'bits_1'],
        ['inspect', str(ROOT / 'test/data/life'), '--plot', 'session.png'],
    ],
    ids=' '.join,
)
def test_option_without_the_laboratory_says_what_to_install(words, monkeypatch, capsys):
    monkeypatch.setattr(packages, 'list_entry_points', EntryPoints)
    assert cli.main(words) == 1
    assert 'the laboratory is missing' in capsys.readouterr().err
