# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The laboratory is a package of its own: it imports this one, and adds commands to `mlmem`."""

import re
from importlib import import_module
from importlib.metadata import EntryPoints
from pathlib import Path

import pytest

from mlmem_ros import packages
from mlmem_tools import checks
from mlmem_tools.cli import laboratory
from mlmem_tools.cli import main as cli
from mlmem_tools.cli.command import Command

ROOT = Path(__file__).parent.parent


def declared(group=laboratory.COMMANDS_GROUP):
    """Return the entry points of the laboratory."""
    _, section = (ROOT / 'lab/pyproject.toml').read_text().split(f"entry-points.'{group}']")
    return dict(re.findall(r"^(\w+) = '(\S+:\w+)'", section.split('[')[0], re.MULTILINE))


def test_its_commands_are_known_by_name():
    """So that `mlmem` can say what to install."""
    assert set(declared()) == set(laboratory.LABORATORY_COMMANDS)
    for place in declared().values():
        module, _, name = place.partition(':')
        assert isinstance(getattr(import_module(module), name), Command)


def test_without_it_the_command_says_what_to_install(monkeypatch, capsys):
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
def test_without_it_a_command_that_needs_a_part_says_so(words, monkeypatch, capsys):
    monkeypatch.setattr(packages, 'list_entry_points', EntryPoints)
    assert cli.main(words) == 1
    assert 'the laboratory is missing' in capsys.readouterr().err


def test_without_it_a_design_is_checked(monkeypatch, capsys):
    """A node that refuses a design names this command."""
    monkeypatch.setattr(packages, 'list_entry_points', EntryPoints)
    monkeypatch.setattr(
        checks, 'CHECK_MODULES', checks.CHECK_MODULES[:2]
    )  # the others take longer
    assert cli.main(['design', 'check', 'bits_1', '--brief']) == 0
