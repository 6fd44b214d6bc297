# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The set-up names what a machine lacks, and what to do about it."""

import importlib.util
import platform
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture
def bootstrap():
    spec = importlib.util.spec_from_file_location('bootstrap', ROOT / 'tools/bootstrap.py')
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Version(tuple):
    """Like sys.version_info."""

    major, minor = property(lambda self: self[0]), property(lambda self: self[1])


@pytest.mark.parametrize(
    ('owner', 'name', 'value', 'expected'),
    [
        (sys, 'version_info', Version((3, 9, 0, 'final', 0)), '3.10 to 3.14'),
        (platform, 'machine', lambda: 'aarch64', 'aarch64'),
        (platform, 'libc_ver', lambda: ('glibc', '2.17'), '2.28'),
        (sys, 'implementation', SimpleNamespace(name='pypy'), 'pypy'),
    ],
)
def test_unsupported_machine_is_named(bootstrap, monkeypatch, owner, name, value, expected):
    monkeypatch.setattr(owner, name, value)
    assert expected in bootstrap.missing_prerequisite()


@pytest.fixture
def commands(bootstrap, monkeypatch, tmp_path):
    """Set up in an empty folder; the commands are noted instead of run."""
    given = []

    def run(command):
        given.append(command)
        for folder, *_ in bootstrap.STAGES.values():
            (tmp_path / folder).mkdir(exist_ok=True)
        return True

    monkeypatch.setattr(bootstrap, 'VENVS', tmp_path)
    monkeypatch.setattr(bootstrap, 'missing_prerequisite', lambda: '')
    monkeypatch.setattr(bootstrap, 'run', run)
    return given


def test_each_command_installs_its_needs_once(bootstrap, commands, capsys):
    """The set-up of the tests contains that of the demonstration."""
    assert bootstrap.main('demo') == 0
    making, installing = commands
    assert 'venv' in making
    first, second = (each for each in installing if str(bootstrap.ROOT) in each)
    assert first.endswith('[ros,view]')
    assert second.endswith('/lab')
    assert '800 MB' in capsys.readouterr().out
    commands.clear()
    assert bootstrap.main('demo') == 0
    assert not commands
    assert bootstrap.main('test') == 0
    (installing,) = commands
    assert {'test', 'lint'} <= set(installing[-3].partition('[')[2].rstrip(']').split(','))
    commands.clear()
    assert bootstrap.main('test') == bootstrap.main('demo') == 0
    assert not commands


def test_failed_check_points_to_colcon(bootstrap, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(bootstrap, 'VENVS', tmp_path)
    monkeypatch.setattr(bootstrap, 'missing_prerequisite', lambda: 'something is missing')
    assert bootstrap.main() == 1
    told = capsys.readouterr().err
    assert 'something is missing' in told
    assert 'colcon build' in told
    assert not (tmp_path / '.venv').exists()
