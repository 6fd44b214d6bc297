# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The output of commands: JSON, and no traceback where nobody reads it."""

import json
import math
import re
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
    ('options', 'said'),
    [
        ('>&-', UNWRITTEN + 'it is closed'),
        ('>/dev/full', UNWRITTEN + 'No space left on device'),
        ('--json >/dev/full', UNWRITTEN + 'No space left on device'),
        ('--json | exit 0; exit ${PIPESTATUS[0]}', '(?!mlmem inspect).*'),  # as `| head` does
    ],
)
def test_output_that_nobody_reads_gives_no_traceback(options, said):
    command = f'{sys.executable} -m mlmem_tools.cli.main inspect {LIFE} {options}'
    done = subprocess.run(
        ['bash', '-c', command], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 1
    assert re.fullmatch(said, done.stderr.splitlines()[-1])
    assert 'Traceback' not in done.stderr
