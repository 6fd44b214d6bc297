# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem design`: finding and proving, by the command line."""

from mlmem_ros.device import preset
from mlmem_ros.parameter_file import load, parse
from mlmem_tools.cli.main import main


def test_a_design_is_found_written_and_proven(tmp_path, capsys):
    file = tmp_path / 'two.yaml'
    options = ['--output', str(file), '--prove', '--jobs', '1', '--folder', str(tmp_path)]
    assert main(['design', '--levels', '2', *options]) == 0
    assert load(str(file)).design == preset('bits_1').design
    said = dict(
        line.split('  ', 1) for line in capsys.readouterr().out.splitlines() if ' of ' in line
    )
    found = {name: value.strip() for name, value in said.items()}
    assert found == {
        'written and read back': '2 of 2',
        'written downward': '1 of 1',
        'erased': '2 of 2',
        'read in a row': '20 of 20',
    }
    # What is done is kept: the same command has nothing left to do.
    assert main(['design', '--levels', '2', *options]) == 0
    table = tmp_path / 'table.md'
    options = ['--markdown', str(table), '--jobs', '1', '--folder', str(tmp_path)]
    assert main(['design', 'prove', str(file), *options]) == 0
    heading, _, row = (line.split(' | ') for line in table.read_text().splitlines())
    proof = dict(zip(heading, row, strict=True))
    assert proof['written and read back'] == proof['erased'] == '2 of 2'
    assert proof['written downward'] == '1 of 1'


def test_without_a_file_the_parameters_are_all_that_is_printed(capsys):
    assert main(['design', '--levels', '2']) == 0
    assert parse(capsys.readouterr().out).design == preset('bits_1').design


def test_what_is_wrong_is_said(capsys):
    assert main(['design']) == 2
    assert 'give --levels P' in capsys.readouterr().err
    assert main(['design', '--levels', '1000']) == 2
    assert 'levels must be a whole number from 2 to 256; got 1000' in capsys.readouterr().err
    assert main(['design', 'prove', 'nothing.yaml']) == 2
    assert 'give a parameter file, or one of' in capsys.readouterr().err
