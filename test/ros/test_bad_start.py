# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node started with bad input names the mistake in one line and ends with status 1."""

import pytest


@pytest.mark.parametrize(
    ('parameter', 'value', 'words'),
    [
        ('element', 'case_3', ['element', "got 'case_3'"]),
        ('target_level', 8, ['target_level', 'from 0 to 7']),
        ('faults.weak_cell', 300, ['faults.weak_cell', 'N = 225']),
        ('design.J', 300, ['element', 'line 3', 'design.J', 'N - tail - 1']),
        ('probe.omega_c', 2.4, ['carrier_left', 'mlmem design check', 'design.check']),
    ],
    ids=str,
)
def test_bad_parameter_ends_the_start(refused, parameter, value, words):
    line = refused({parameter: value, 'design.check': 'refuse'})
    for word in ['cannot start', *words]:
        assert word in line


@pytest.mark.parametrize(
    ('name', 'value', 'kind'),
    [
        ('linger', 'strong', 'a double'),
        ('linger', 1, 'a double (a number with a decimal point)'),
        ('write.attempts', 2.5, 'an integer'),
    ],
    ids=str,
)
def test_parameter_of_a_wrong_type_ends_the_start(refused, tmp_path, name, value, kind):
    file = tmp_path / 'wrong.yaml'
    file.write_text(f'/**: {{ros__parameters: {{{name}: {value}}}}}')
    assert f'cannot start: parameter {name} must be {kind}' in refused(file=file)


@pytest.mark.parametrize('text', ['/**:\n  ros__parameters:\n    write: {tension: 0.048\n', None])
def test_bad_parameter_file_ends_the_start(refused, tmp_path, text):
    file = tmp_path / 'given.yaml'
    if text:
        file.write_text(text)
    line = refused(file=file)
    assert str(file) in line
    assert not text or 'line 3' in line or 'line 4' in line


def test_unknown_ros_option_ends_the_start(refused):
    assert '--bogus' in refused(options=['--bogus'])
