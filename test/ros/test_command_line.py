# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The options of the executable, the speed of time, and starts that end for bad input."""

import pytest

from mlmem_ros import __version__
from mlmem_ros.ros.main import parse_node_arguments
from mlmem_tools.cli.main import main as mlmem

ROS = ['--ros-args', '--log-level', 'warn', '-p', 'time.speed:=7.0', '-r', '__node:=other']


@pytest.mark.parametrize('given', [ROS, [*ROS, '--'], []])
def test_options_of_ros_are_passed_on(given):
    assert parse_node_arguments(['node', *given]) == ['node', *given]


@pytest.mark.parametrize(
    ('given', 'word'),
    [
        (['--bogus'], '--bogus'),
        (['bogus'], 'bogus'),
        (['--vers'], '--vers'),
        (['--bogus', '--ros-args', '--'], '--bogus'),
        ([*ROS, '--', 'bogus'], 'bogus'),
    ],
    ids=str,
)
def test_unknown_option_is_rejected(given, word, capsys):
    with pytest.raises(SystemExit) as refused:
        parse_node_arguments(['node', *given])
    assert refused.value.code == 2
    assert word in capsys.readouterr().err


@pytest.mark.parametrize('of', [mlmem, lambda given: parse_node_arguments(['node', *given])])
def test_version_is_printed(of, capsys):
    with pytest.raises(SystemExit) as told:
        of(['--version'])
    assert told.value.code == 0
    assert capsys.readouterr().out == f'mlmem_ros {__version__}\n'


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({'element': 'case_3'}, ['element', "got 'case_3'"]),
        ({'target_level': 8}, ['target_level', 'from 0 to 7']),
        ({'faults.weak_cell': 300}, ['faults.weak_cell', 'N = 225']),
        ({'design.J': 300}, ['element', 'line 3', 'design.J', 'N - tail - 1']),
        ({'twin': '/nowhere.yaml'}, ['twin: /nowhere.yaml: ']),
        (
            {'device.driver': 'rig', 'device.retry': 1.0, 'device.address': 'slot 2'},
            ['device.address must be tcp://'],
        ),
        (
            {'device.driver': 'rig', 'device.address': 'tcp://127.0.0.1:1'},
            ['no rig at tcp://127.0.0.1:1'],
        ),
        ({'linger': 'strong'}, ['linger must be a double']),
        ({'linger': 1}, ['linger must be a double (a number with a decimal point)']),
        ({'write.attempts': 2.5}, ['write.attempts must be an integer']),
    ],
    ids=str,
)
def test_bad_parameter_ends_the_start(refused, given, words):
    line = refused({'design.check': 'skip'} | given)
    for word in ['cannot start', *words]:
        assert word in line


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
