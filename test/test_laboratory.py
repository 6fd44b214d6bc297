# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The laboratory is a package of its own: it imports this one, and adds commands to `mlmem`."""

import os
import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path

import pytest

from mlmem_ros import packages
from mlmem_tools import checks
from mlmem_tools.cli import commands, laboratory
from mlmem_tools.cli import main as cli
from mlmem_tools.cli.command import Command

ROOT = Path(__file__).parent.parent
OURS = ('mlmem_ros', 'mlmem_tools', 'test')


def declared(group=laboratory.COMMANDS):
    """Return the entry points of the laboratory."""
    _, section = (ROOT / 'lab/pyproject.toml').read_text().split(f"entry-points.'{group}']")
    return dict(re.findall(r"^(\w+) = '(\S+:\w+)'", section.split('[')[0], re.MULTILINE))


def test_nothing_here_imports_it():
    imports = re.compile(r'^\s*(from|import) mlmem_lab', re.MULTILINE)
    sources = (
        each
        for name in ('mlmem_ros', 'mlmem_tools', 'test')
        for each in (ROOT / name).rglob('*.py')
    )
    assert [str(each) for each in sources if imports.search(each.read_text())] == []


def test_its_commands_are_known_by_name():
    """So that `mlmem` can say what to install."""
    assert set(declared()) == set(laboratory.NAMES)
    for place in declared().values():
        module, _, name = place.partition(':')
        assert isinstance(getattr(import_module(module), name), Command)


def test_a_command_leaves_the_other_cores_alone():
    """What it sets is in time: here the program ends where numpy is about to be loaded."""
    program = """
import os, sys
class Numpy:
    def find_spec(self, name, *_):
        if name == 'numpy':
            print(os.environ['OPENBLAS_NUM_THREADS'], flush=True)
            os._exit(0)
sys.meta_path.insert(0, Numpy())
from mlmem_tools.cli.main import main
main(['inspect', 'test/data/life'])
"""
    given = {name: value for name, value in os.environ.items() if name != 'OPENBLAS_NUM_THREADS'}
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, cwd=ROOT, env=given
    )
    assert done.stdout == '1\n', done.stderr


def test_without_it_the_command_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr(packages, 'entries', EntryPoints)
    for name in laboratory.NAMES:
        assert cli.main([name, '--json']) == 1
        told = capsys.readouterr().err
        assert f'mlmem {name}: the laboratory is missing' in told
        assert 'pip install' in told


def test_with_it_the_command_is_found_and_listed(monkeypatch, capsys):
    points = [EntryPoint(name, place, laboratory.COMMANDS) for name, place in declared().items()]
    monkeypatch.setattr(packages, 'entries', lambda: EntryPoints(points))
    assert set(laboratory.NAMES) <= set(commands.parser().format_help().split())
    with pytest.raises(SystemExit):
        cli.main(['measured', '--help'])
    assert 'random chains' in capsys.readouterr().out


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
    monkeypatch.setattr(packages, 'entries', EntryPoints)
    assert cli.main(words) == 1
    assert 'the laboratory is missing' in capsys.readouterr().err


def test_without_it_a_design_is_checked(monkeypatch, capsys):
    """A node that refuses a design names this command."""
    monkeypatch.setattr(packages, 'entries', EntryPoints)
    monkeypatch.setattr(checks, 'CONCERNS', checks.CONCERNS[:2])  # the others take longer
    assert cli.main(['design', 'check', 'bits_1', '--brief']) == 0


def test_its_parts_are_there():
    parts = declared(laboratory.PARTS)
    assert laboratory.PICTURE in parts
    for place in parts.values():
        module, _, name = place.partition(':')
        assert callable(getattr(import_module(module), name))
