# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The output of commands: JSON, and no traceback where nobody reads it."""

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

from mlmem_ros.session.data import load_session
from mlmem_tools.cli.main import main
from mlmem_tools.cli.output import print_json

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
    assert [each['procedure'] for each in found['procedures']] == [
        'write',
        'read',
        'erase',
        'read',
    ]
    assert found['lost'] == []


@pytest.mark.parametrize(
    ('redirection', 'reason'),
    [('>&-', 'it is closed'), ('>/dev/full', 'No space left on device')],
)
@pytest.mark.parametrize('options', ['', '--json'])
def test_mlmem_without_output_says_so_and_returns_1(redirection, reason, options):
    command = f'{sys.executable} -m mlmem_tools.cli.main inspect {LIFE} {options} {redirection}'
    done = subprocess.run(
        command, shell=True, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f'mlmem inspect: the output cannot be written: {reason}'
    assert 'Traceback' not in done.stderr


def test_closed_output_gives_no_traceback(tmp_path):
    """As `mlmem inspect SESSION | head` does."""
    read, write = os.pipe()
    os.close(read)
    errors = tmp_path / 'errors'
    with errors.open('w') as told:
        command = [sys.executable, '-m', 'mlmem_tools.cli.main', 'inspect', str(LIFE)]
        done = subprocess.run(command, stdout=write, stderr=told, check=False, timeout=60)
    os.close(write)
    assert (done.returncode, errors.read_text()) == (1, '')
