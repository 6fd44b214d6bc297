# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The doctor names problems and their cure, whatever is missing."""

import errno
import os
import sys

import pytest

from mlmem import ELEMENT_NAMES
from mlmem.physics import INTEGRATORS, jit
from mlmem_ros.host import design_check
from mlmem_tools.cli import doctor
from mlmem_tools.cli.main import main


@pytest.mark.parametrize(
    ('version', 'verdict'),
    [((3, 9), 'fail'), ((3, 10), 'pass'), ((3, 14), 'pass'), ((3, 15), 'warn')],
)
def test_python_version_has_a_verdict(version, verdict):
    assert doctor.check_python(version).verdict == verdict


def test_missing_or_broken_library_gives_advice(tmp_path, monkeypatch):
    (tmp_path / 'broken_library.py').write_text('raise OSError("libfoo.so.1: no such file")')
    monkeypatch.syspath_prepend(tmp_path)
    assert doctor.check_library('broken_library').seen == 'libfoo.so.1: no such file'
    monkeypatch.setitem(sys.modules, 'numba', None)
    missing = doctor.check_library('numba')
    assert missing.verdict == 'fail'
    assert missing.advice.startswith('sudo apt install python3-numba')
    monkeypatch.setitem(sys.modules, 'mcap', None)
    missing = doctor.check_library('mcap')
    assert missing.verdict == 'warn'
    assert missing.seen.endswith('no recording and replay')
    assert missing.advice.startswith('python3 -m pip install mcap')


@pytest.mark.parametrize(
    ('value', 'verdict'),
    [('0', 'pass'), ('42', 'pass'), ('101', 'pass'), ('102', 'fail'), ('-1', 'fail'),
     ('four', 'fail'), ('', 'warn'), (None, 'warn')],
)  # fmt: skip
def test_domain_has_a_verdict(value, verdict, monkeypatch):
    monkeypatch.delenv('ROS_AUTOMATIC_DISCOVERY_RANGE', raising=False)
    found = doctor.check_domain(value)
    assert found.verdict == verdict
    assert bool(found.advice) == (verdict != 'pass')


def full_disk(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize(
    ('name', 'replaced', 'seen', 'advice'),
    [
        ('find_cache_folder', lambda _: None, 'no folder can be written', 'NUMBA_CACHE_DIR'),
        ('check_cache_space', full_disk, 'No space left on device', 'NUMBA_CACHE_DIR'),
    ],
)
def test_compile_cache_that_cannot_be_used_is_a_warning(name, replaced, seen, advice, monkeypatch):
    assert doctor.check_compile_cache().verdict == 'pass'
    monkeypatch.setattr(jit, name, replaced)
    found = doctor.check_compile_cache()
    assert found.verdict == 'warn'
    assert seen in found.seen
    assert advice in found.advice


def test_element_slower_than_real_time_is_a_warning(monkeypatch):
    assert doctor.check_speed().seen.endswith('times real time')
    clock = iter((0.0, 3.0))
    monkeypatch.setattr(doctor.time, 'monotonic', lambda: next(clock))
    found = doctor.check_speed()
    assert (found.verdict, found.seen) == ('warn', 'a second of the element takes 3.0 s')


def test_doctor_without_ros_says_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'rclpy', None)
    assert main(['doctor']) == 1
    told = capsys.readouterr().out
    assert 'fail  ROS 2' in told
    assert 'setup.bash' in told


def test_warm_does_all_tasks_of_a_first_start(monkeypatch, capsys):
    """Every loop with every substrate, and every preset's check."""
    checked = []
    monkeypatch.setattr(design_check, 'load_findings', lambda *element: checked.append(element))
    monkeypatch.setattr(doctor, 'examine_machine', lambda: [])
    assert main(['doctor', '--warm']) == 0
    assert len(checked) == len(ELEMENT_NAMES)
    told = capsys.readouterr().out
    assert told.count('warm  kernel') == 2 * len(INTEGRATORS)
