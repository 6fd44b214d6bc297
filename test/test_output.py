# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What commands print: JSON, what a machine lacks and how to cure it, and no traceback where
nobody reads it.
"""

import errno
import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass
from enum import Enum
from importlib.metadata import EntryPoints
from pathlib import Path
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from mlmem import ELEMENT_NAMES, physics
from mlmem.physics import jit
from mlmem_ros import packages
from mlmem_ros.host import design_check
from mlmem_ros.session.data import load_session
from mlmem_tools.cli import doctor, laboratory
from mlmem_tools.cli.main import main
from mlmem_tools.cli.output import print_json

UNWRITTEN = 'mlmem inspect: the output cannot be written: '
LIFE = Path(__file__).parent / 'data' / 'life'


class Colour(Enum):
    RED = 'red'


@dataclass
class Pair:
    colour: Colour
    where: Path


def test_print_json_writes_plain_values(capsys):
    print_json(
        {
            'pair': Pair(Colour.RED, Path('a/b')),
            'rows': (np.arange(2), np.float64(0.5), math.inf, math.nan),
            1: MappingProxyType({'yes': True, 'none': None}),
        }
    )
    assert json.loads(capsys.readouterr().out, parse_constant=pytest.fail) == {
        'pair': {'colour': 'red', 'where': 'a/b'},
        'rows': [[0, 1], 0.5, None, None],
        '1': {'yes': True, 'none': None},
    }


def test_inspect_json_holds_the_session(capsys):
    assert main(['inspect', str(LIFE), '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert found['topics']['/mlmem/session/command']['messages'] == 4
    (tick, write), *_ = load_session(LIFE).stamped
    assert found['commands'][0] == {'tick': tick, 'kind': 'Write', 'level': write.level}
    procedures = [each['procedure'] for each in found['procedures']]
    assert procedures == ['write', 'read', 'erase', 'read']
    assert found['lost'] == []


@pytest.mark.parametrize(
    ('target', 'why'), [('&-', 'it is closed'), ('/dev/full', 'No space left on device')]
)
def test_output_that_nobody_reads_gives_no_traceback(target, why):
    command = f'{sys.executable} -m mlmem_tools.cli.main inspect {LIFE} >{target}'
    done = subprocess.run(
        ['bash', '-c', command], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == UNWRITTEN + why
    assert 'Traceback' not in done.stderr


def test_json_that_cannot_be_written_ends_the_command(monkeypatch, capsys):
    """Who closes a pipe, as `head`, has seen enough; nothing that is left is written later."""
    reading, writing = os.pipe()
    os.close(reading)
    full = os.open('/dev/full', os.O_WRONLY)
    for descriptor, is_reported in ((full, True), (writing, False)):
        with os.fdopen(descriptor, 'w') as file, monkeypatch.context() as patch:
            patch.setattr(sys, 'stdout', file)
            assert main(['inspect', str(LIFE), '--json']) == 1
        said = capsys.readouterr().err
        assert (UNWRITTEN in said) == is_reported


# --- what a machine lacks ------------------------------------------------------------------------


def examine(capsys):
    """Return the exit status of the doctor, and what it found by name."""
    status = main(['doctor', '--json'])
    found = json.loads(capsys.readouterr().out)['findings']
    return status, {each['what']: SimpleNamespace(**each) for each in found}


def test_healthy_machine_passes_with_versions(monkeypatch, capsys):
    monkeypatch.setenv('ROS_DOMAIN_ID', '101')
    status, found = examine(capsys)
    assert status == 0
    assert {each.verdict for each in found.values()} == {'pass'}
    assert not any(each.advice for each in found.values())
    assert all(found[name].seen[0].isdigit() for name in ('numba', 'rclpy'))
    assert found['speed'].seen.endswith('times real time')


def test_machine_that_lacks_all_gets_advice(monkeypatch, capsys, tmp_path):
    """Whether a library is missing or broken, what can be checked without it is."""
    (tmp_path / 'mcap.py').write_text('raise OSError("libfoo.so.1: no such file")')
    monkeypatch.delitem(sys.modules, 'mcap', raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, 'rclpy', None)
    monkeypatch.setattr(physics, 'find_cache_folder', lambda: None)
    clock = iter((0.0, 3.0))
    monkeypatch.setattr(doctor, 'time', SimpleNamespace(monotonic=lambda: next(clock)))
    status, found = examine(capsys)
    assert status == 1
    for name, verdict, seen, advice in (
        ('rclpy', 'fail', 'rclpy', 'source /opt/ros/jazzy/setup.bash'),
        ('mcap', 'warn', 'libfoo.so.1: no such file', 'python3 -m pip install mcap'),
        ('compiled kernels', 'warn', 'no folder can be written', 'set NUMBA_CACHE_DIR'),
        ('speed', 'warn', 'a second of the element takes 3.0 s', 'use a processor'),
    ):
        assert found[name].verdict == verdict
        assert seen in found[name].seen
        assert found[name].advice.startswith(advice)
    monkeypatch.setitem(sys.modules, 'numba', None)
    _, found = examine(capsys)
    assert found['numba'].verdict == 'fail'
    assert 'speed' not in found


def test_full_compile_cache_is_a_warning(monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(jit, 'check_cache_space', fail)
    found = doctor.check_compile_cache()
    assert (found.verdict, 'No space left' in found.seen) == ('warn', True)


@pytest.mark.parametrize(
    ('value', 'verdict'),
    [('0', 'pass'), ('102', 'fail'), ('-1', 'fail'), ('four', 'fail'), ('', 'warn')],
)
def test_domain_has_a_verdict(value, verdict):
    found = doctor.check_domain(value)
    assert found.verdict == verdict
    assert bool(found.advice) == (verdict != 'pass')


def test_warm_checks_every_shipped_element(monkeypatch):
    checked = []
    monkeypatch.setattr(design_check, 'load_findings', lambda *element: checked.append(element))
    monkeypatch.setattr(doctor, 'examine_machine', lambda: [])
    assert main(['doctor', '--warm']) == 0
    assert len(checked) == len(ELEMENT_NAMES)


# --- optional packages ---------------------------------------------------------------------------

INSPECT_WITHOUT_PACKAGES = """
import sys
sys.modules.update(dict.fromkeys('mcap rosbags lz4 zstandard scipy matplotlib rich PIL'.split()))
import mlmem_tools.cli.main as cli
sys.exit(cli.main(['inspect', 'bag']))
"""


def test_command_names_the_missing_package():
    command = [sys.executable, '-c', INSPECT_WITHOUT_PACKAGES]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith('mlmem inspect: the Python package ')
    assert 'install' in done.stderr
    assert done.stderr.count('\n') == 1


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('std_msgs.msg', ['ROS 2', '/opt/ros/jazzy/setup.bash', 'ros-jazzy-rclpy']),
        ('mcap.writer', ['package mcap', 'pip install mcap', '--break-system-packages']),
        ('yaml', ['pip install pyyaml']),
    ],
)
def test_advice_fits_the_missing_package(name, words):
    said = packages.describe_missing(ModuleNotFoundError('no such thing', name=name))
    assert all(word in said for word in words)
    assert '\n' not in said


@pytest.mark.parametrize(
    'words',
    [
        *([name, '--json'] for name in laboratory.LABORATORY_COMMANDS),
        ['design', '--levels', '2'],
        ['design', 'prove', 'bits_1'],
        ['inspect', str(LIFE), '--plot', 'session.png'],
    ],
    ids=lambda words: f'{words[0]} {words[-1]}',
)
def test_command_without_the_laboratory_says_what_to_install(words, monkeypatch, capsys):
    monkeypatch.setattr(packages, 'entry_points', lambda group: EntryPoints())
    assert main(words) == 1
    assert 'the laboratory is missing; in a checkout: pip install' in capsys.readouterr().err
