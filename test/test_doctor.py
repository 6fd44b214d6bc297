# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The doctor names problems and their cure, whatever is missing."""

import errno
import json
import os
import sys
from types import SimpleNamespace

import pytest

from mlmem import ELEMENT_NAMES
from mlmem.physics import jit
from mlmem_ros.host import design_check
from mlmem_tools.cli import doctor
from mlmem_tools.cli.main import main


def test_missing_or_broken_library_gives_advice(tmp_path, monkeypatch):
    (tmp_path / 'broken_library.py').write_text('raise OSError("libfoo.so.1: no such file")')
    monkeypatch.syspath_prepend(tmp_path)
    assert doctor.check_library('broken_library').seen == 'libfoo.so.1: no such file'
    for name, verdict, advice in (
        ('numba', 'fail', 'python3 -m pip install numba'),
        ('mcap', 'warn', 'python3 -m pip install mcap'),
        ('rclpy', 'fail', 'source /opt/ros/jazzy/setup.bash'),
    ):
        monkeypatch.setitem(sys.modules, name, None)
        missing = doctor.check_library(name)
        assert missing.verdict == verdict
        assert missing.advice.startswith(advice)


@pytest.mark.parametrize('name', ['numba', 'rclpy'])
def test_installed_library_passes_with_its_version(name):
    found = doctor.check_library(name)
    assert found.verdict == 'pass'
    assert found.seen[0].isdigit()


@pytest.mark.parametrize(
    ('value', 'verdict'),
    [('0', 'pass'), ('101', 'pass'), ('102', 'fail'), ('-1', 'fail'), ('four', 'fail'),
     ('', 'warn')],
)  # fmt: skip
def test_domain_has_a_verdict(value, verdict):
    found = doctor.check_domain(value)
    assert found.verdict == verdict
    assert bool(found.advice) == (verdict != 'pass')


def full_disk(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize(
    ('name', 'replaced', 'seen'),
    [
        ('find_cache_folder', lambda _: None, 'no folder can be written'),
        ('check_cache_space', full_disk, 'No space left on device'),
    ],
)
def test_compile_cache_that_cannot_be_used_is_a_warning(name, replaced, seen, monkeypatch):
    assert doctor.check_compile_cache().verdict == 'pass'
    monkeypatch.setattr(jit, name, replaced)
    found = doctor.check_compile_cache()
    assert found.verdict == 'warn'
    assert seen in found.seen


def test_element_slower_than_real_time_is_a_warning(monkeypatch):
    assert doctor.check_speed().seen.endswith('times real time')
    clock = iter((0.0, 3.0))
    monkeypatch.setattr(doctor, 'time', SimpleNamespace(monotonic=lambda: next(clock)))
    found = doctor.check_speed()
    assert (found.verdict, found.seen) == ('warn', 'a second of the element takes 3.0 s')


def test_doctor_without_ros_fails(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'rclpy', None)
    assert main(['doctor', '--json']) == 1
    found = json.loads(capsys.readouterr().out)['findings']
    assert [each['what'] for each in found if each['verdict'] == 'fail'] == ['rclpy']


def test_warm_checks_every_shipped_element(monkeypatch):
    checked = []
    monkeypatch.setattr(design_check, 'load_findings', lambda *element: checked.append(element))
    monkeypatch.setattr(doctor, 'examine_machine', lambda: [])
    assert main(['doctor', '--warm']) == 0
    assert len(checked) == len(ELEMENT_NAMES)
