# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The output of commands: JSON, and tables that fit a terminal."""

import io
import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from rich.console import Console

from mlmem_ros.session.data import load
from mlmem_tools.cli.commands import SUBCOMMANDS
from mlmem_tools.cli.main import main
from mlmem_tools.cli.output import plain_table, print_json

LIFE = Path(__file__).parent / 'data' / 'life'


class Colour(Enum):
    RED = 'red'


@dataclass
class Pair:
    colour: Colour
    where: Path


def test_json_holds_plain_values(capsys):
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


def test_every_command_prints_json_on_demand(capsys):
    for name in SUBCOMMANDS:
        with pytest.raises(SystemExit):
            main([name, '--help'])
        assert '--json' in capsys.readouterr().out, name


def test_a_session_as_json(capsys):
    assert main(['inspect', str(LIFE), '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert found['topics']['/mlmem/session/command']['messages'] == 4
    (tick, write), *_ = load(LIFE).stamped
    assert found['commands'][0] == {'tick': tick, 'kind': 'Write', 'level': write.level}
    assert [each['procedure'] for each in found['procedures']] == [
        'write',
        'read',
        'erase',
        'read',
    ]
    assert [echo['level'] for echo in found['echoes']][:3] == [None, None, 2]
    assert found['lost'] == []


def test_a_machine_as_json(capsys):
    status = main(['doctor', '--node', 'nobody', '--wait', '0.1', '--json'])
    findings = json.loads(capsys.readouterr().out)['findings']
    assert {'pass'} < {each['verdict'] for each in findings} <= {'pass', 'warn', 'fail'}
    assert status == any(each['verdict'] == 'fail' for each in findings)


def test_a_table_fits_80_columns_with_whole_headings():
    headings = ('>time', 'procedure', '>level margin', '>threshold margin', 'error')
    table = plain_table('procedures', *headings)
    table.add_row('123456.789 s', 'calibrate', '0.94', '4.37', 'word ' * 30 + 'x' * 120)
    text = io.StringIO()
    Console(file=text, width=80).print(table)
    lines = text.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    for heading in headings:
        for word in heading.removeprefix('>').split():
            assert any(word in line.split() for line in lines), word
    assert text.getvalue().count('x') >= 120  # folded, not cut


def test_the_tables_of_a_session_fit(capsys, monkeypatch):
    monkeypatch.setenv('COLUMNS', '80')
    assert main(['inspect', str(LIFE)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    for word in (
        'topic',
        'messages',
        'procedure',
        'margins',
        'echoes',
    ):
        assert any(word in line.split() for line in lines), word


def test_who_has_seen_enough_of_the_output_gets_no_traceback(tmp_path):
    """As `mlmem inspect SESSION | head` does."""
    read, write = os.pipe()
    os.close(read)
    errors = tmp_path / 'errors'
    with errors.open('w') as told:
        command = [sys.executable, '-m', 'mlmem_tools.cli.main', 'inspect', str(LIFE)]
        done = subprocess.run(command, stdout=write, stderr=told, check=False, timeout=60)
    os.close(write)
    assert (done.returncode, errors.read_text()) == (1, '')
