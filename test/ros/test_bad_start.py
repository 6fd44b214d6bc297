# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node started with bad input names the mistake in one line and ends with status 1."""

import re

import pytest

PARAMETERS = """/**:
  ros__parameters:
    {name}: {value}
"""


@pytest.mark.parametrize(
    ('parameter', 'value', 'reason'),
    [
        ('element', 'case_3', "element must be one of case_1, .*; got 'case_3'$"),
        ('target_level', 8, 'parameter target_level must be from 0 to 7; got 8$'),
        (
            'faults.weak_cell',
            300,
            'parameters faults.weak_cell must be from 0 to N = 225; got 300$',
        ),
        ('design.J', 300, r'element: .*, line 3: design\.J must be at most N - tail - 1'),
    ],
    ids=str,
)
def test_bad_parameter_ends_the_start(refused, parameter, value, reason):
    assert re.search(f'cannot start: {reason}', refused({parameter: value}))


DOUBLE = 'a double (a number with a decimal point)'


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('linger', 'strong', f"must be {DOUBLE}; got 'strong'"),
        ('linger', 1, f'must be {DOUBLE}; got 1'),
        ('write.attempts', 2.5, 'must be an integer; got 2.5'),
    ],
    ids=str,
)
def test_parameter_of_a_wrong_type_ends_the_start(refused, tmp_path, name, value, reason):
    file = tmp_path / 'wrong.yaml'
    file.write_text(PARAMETERS.format(name=name, value=value))
    assert refused(file=file).endswith(f'cannot start: parameter {name} {reason}')


def test_malformed_parameter_file_ends_the_start(refused, tmp_path):
    file = tmp_path / 'malformed.yaml'
    file.write_text('/**:\n  ros__parameters:\n    write: {tension: 0.048\n')
    line = refused(file=file)
    assert str(file) in line
    assert 'line 3' in line or 'line 4' in line


def test_a_missing_parameter_file(refused, tmp_path):
    file = tmp_path / 'missing.yaml'
    assert str(file) in refused(file=file)


def test_an_unknown_ros_option(refused):
    assert "only ROS options; got ['--bogus']" in refused(options=['--bogus'])


def test_a_design_that_fails_its_check(refused):
    line = refused({'probe.omega_c': 2.4})
    for word in ['carrier_left', '2.4 is in neither band', 'mlmem design check', 'design.check']:
        assert word in line
