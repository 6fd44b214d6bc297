# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The doctor names problems and their cure, whatever is missing."""

import errno
import os
import subprocess
import sys
from collections import namedtuple

import pytest

from mlmem.physics import INTEGRATORS, jit
from mlmem.presets import PRESETS
from mlmem_ros.host.design_check import Verdict
from mlmem_tools.cli import checkup, doctor
from mlmem_tools.cli.main import main

PASS, WARN, FAIL = Verdict.PASS, Verdict.WARN, Verdict.FAIL


@pytest.mark.parametrize(
    ('version', 'verdict'), [((3, 9), FAIL), ((3, 10), PASS), ((3, 14), PASS), ((3, 15), WARN)]
)
def test_python_version_has_a_verdict(version, verdict):
    assert checkup.check_python(version).verdict is verdict


def test_missing_or_broken_library_gives_advice(tmp_path, monkeypatch):
    (tmp_path / 'broken_library.py').write_text('raise OSError("libfoo.so.1: no such file")')
    monkeypatch.syspath_prepend(tmp_path)
    assert checkup.check_library('broken_library').seen == 'libfoo.so.1: no such file'
    monkeypatch.setitem(sys.modules, 'numba', None)
    missing = checkup.check_library('numba')
    assert missing.verdict is FAIL
    assert missing.advice.startswith('sudo apt install python3-numba')
    monkeypatch.setitem(sys.modules, 'mcap', None)
    missing = checkup.check_library('mcap')
    assert missing.verdict is WARN
    assert missing.seen.endswith('no recording and replay')
    assert missing.advice.startswith('python3 -m pip install mcap')


@pytest.mark.parametrize(
    ('value', 'verdict'),
    [('0', PASS), ('42', PASS), ('101', PASS), ('102', WARN), ('232', WARN), ('233', FAIL),
     ('-1', FAIL), ('four', FAIL), ('', WARN), (None, WARN)],
)  # fmt: skip
def test_domain_has_a_verdict(value, verdict, monkeypatch):
    monkeypatch.delenv('ROS_AUTOMATIC_DISCOVERY_RANGE', raising=False)
    found = checkup.check_domain(value)
    assert found.verdict is verdict
    assert bool(found.advice) == (verdict is not PASS)


@pytest.mark.parametrize(('free', 'verdict'), [(2e9, PASS), (5e8, WARN), (5e7, FAIL)])
def test_free_space_has_a_verdict(free, verdict, tmp_path, monkeypatch):
    usage = namedtuple('usage', 'total used free')
    monkeypatch.setattr('shutil.disk_usage', lambda _: usage(int(1e10), 0, int(free)))
    assert checkup.check_disk(tmp_path / 'not' / 'there' / 'yet').verdict is verdict


def full_disk(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize(
    ('name', 'replaced', 'seen', 'advice'),
    [
        ('find_cache_folder', lambda _: None, 'Permission denied', 'NUMBA_CACHE_DIR'),
        ('check_cache_space', full_disk, 'No space left on device', 'NUMBA_CACHE_DIR'),
    ],
)
def test_compile_cache_that_cannot_be_used_is_a_warning(name, replaced, seen, advice, monkeypatch):
    assert checkup.check_compile_cache().verdict is PASS
    monkeypatch.setattr(jit, name, replaced)
    found = checkup.check_compile_cache()
    assert found.verdict is WARN
    assert seen in found.seen
    assert advice in found.advice


def test_doctor_without_ros_says_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'rclpy', None)
    assert main(['doctor']) == 1
    told = capsys.readouterr().out
    assert 'fail  ROS 2' in told
    assert 'setup.bash' in told
    assert 'node mlmem' not in told  # without ROS it is not asked


def test_doctor_warns_of_a_missing_node(tmp_path):
    """In its own process, as rclpy reads the environment when it is imported."""
    pytest.importorskip('rclpy')
    from mlmem_ros.ros.node_process import run_child_process

    command = ['doctor', '--node', 'nobody', '--wait', '0.2', '--records', str(tmp_path)]
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.STDOUT, 'text': True}
    with run_child_process('mlmem_tools.cli.main', command, **streams) as process:
        told, _ = process.communicate(timeout=120)
    assert process.returncode == 0, told
    assert 'warn  node nobody        does not answer within 0.2 s' in told
    assert told.count('fail  ') == 0


def test_warm_does_all_tasks_of_a_first_start(monkeypatch, capsys):
    """Every loop with every substrate, and every preset's check."""
    names = [name for name, _ in doctor.list_start_tasks()]
    assert len(names) == 2 * len(INTEGRATORS) + len(PRESETS)
    assert f'design check of {next(iter(PRESETS))}' in names
    done = []
    steps = [(name, lambda name=name: done.append(name)) for name in names]
    monkeypatch.setattr(doctor, 'list_start_tasks', lambda: steps)
    monkeypatch.setattr(checkup, 'examine_machine', lambda *_: [])
    assert main(['doctor', '--warm']) == 0
    assert done == names
    assert f'warm  {names[-1]}' in capsys.readouterr().out
