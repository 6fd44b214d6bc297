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
    ('target', 'why'), [('&-', 'it is closed'), ('/dev/full', 'No space left on device')]
)
def test_output_that_nobody_reads_gives_no_traceback(target, why):
    command = f'{sys.executable} -m mlmem_tools.cli.main inspect {LIFE} >{target}'
    done = subprocess.run(
        ['bash', '-c', command], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == UNWRITTEN + why
    assert 'Traceback' not in done.stderr


def test_json_that_cannot_be_written_ends_the_command(monkeypatch, capsys):
    """Who closes a pipe, as `head`, has seen enough; nothing that is left is written later."""
    reading, writing = os.pipe()
    os.close(reading)
    full = os.open('/dev/full', os.O_WRONLY)
    for descriptor, is_reported in ((full, True), (writing, False)):
        with os.fdopen(descriptor, 'w') as file, monkeypatch.context() as patch:
            patch.setattr(sys, 'stdout', file)
            assert main(['inspect', str(LIFE), '--json']) == 1
        said = capsys.readouterr().err
        assert (UNWRITTEN in said) == is_reported
