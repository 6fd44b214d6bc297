# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The records of a session, its commands among them, survive a file; invalid ones are refused."""

import json

import numpy as np
import pytest
import rig
from suite import replace_value

from mlmem import (
    Abort,
    Calibrate,
    Disturb,
    Erase,
    Faults,
    FollowTrajectory,
    Kick,
    Locate,
    Read,
    Reset,
    SelfTest,
    SetFaults,
    SetMethod,
    SetStrain,
    Survey,
    Write,
)
from mlmem.commands import COMMANDS_BY_NAME
from mlmem.instrument.end import End, Shot
from mlmem.parsing import DecodeError
from mlmem_ros import __version__
from mlmem_ros.bag import jazzy
from mlmem_ros.bag.errors import BagError
from mlmem_ros.contract.streams import SHOT_HEAD_SIZE, decode_shot, encode_shot
from mlmem_ros.session import records
from mlmem_ros.session.data import SessionData
from mlmem_ros.session.records import (
    build_command,
    command_to_dict,
    name_errors,
    read_command,
    read_header,
    read_state_hash,
)
from mlmem_ros.session.replay import build_element, find_last_tick, run_replay

COMMANDS = [
    SetStrain(0.1 + 0.2), SetStrain(-5e-324), FollowTrajectory((0.1, 0.3), (0.01, 0.0)),
    FollowTrajectory((0.1,), (0.1 + 0.2,), (-5e-324,), 'substrate'),
    Write(7), Read(), Read('right'), Erase(), Calibrate(), SelfTest(), Locate(), Reset(), Reset(2),
    Survey(), Kick(0.1 + 0.2),
    Abort(), Abort('the device is shut down'),
    SetMethod('kick'), Disturb(1.0 / 3.0), SetFaults(Faults()),
    SetFaults(Faults(sensor_noise=0.1, weak_cell=7)),
]  # fmt: skip


def text(cdr):
    return jazzy.deserialize_message(cdr, 'std_msgs/msg/String').data


@pytest.mark.parametrize('command', COMMANDS, ids=str)
def test_command_survives_a_file_to_the_bit(command):
    assert read_command(text(build_command(7, command))) == (7, command)


def test_every_command_is_tested_and_has_a_kind():
    assert {type(command) for command in COMMANDS} == set(COMMANDS_BY_NAME.values())
    assert command_to_dict(Write(3)) == {'kind': 'Write', 'level': 3}


@pytest.mark.parametrize(
    ('command', 'field'),
    [
        ('{"tick": null}', 'tick'),
        ('{"tick": 1}', 'kind'),
        ('{"tick": 1, "kind": "write", "level": 1}', 'kind'),
        ('{"tick": 1, "kind": ["Write"]}', 'kind'),
        ('{"tick": 1, "kind": "Erase", "level": 1}', 'level'),
        ('{"tick": 1, "kind": "Disturb", "acceleration": 1e999}', 'acceleration'),
        ('{"tick": 1, "kind": "SetFaults", "faults": {"seed": -1}}', 'faults.seed'),
        ('{"tick": NaN}', 'NaN'),
        ('{"tick": %s}' % ('9' * 5000), 'JSON'),
        ('[' * 10**6, 'nested'),
    ],
    ids=lambda text: text[:60],
)
def test_text_that_is_no_command_is_rejected(command, field):
    """What else is none is in test_outside.py."""
    with pytest.raises(BagError, match=field) as caught, name_errors('~/command at 12.300 s'):
        read_command(command)
    assert str(caught.value).startswith('~/command at 12.300 s: ')
    assert len(str(caught.value)) < 400


@pytest.fixture(scope='module')
def element():
    return rig.device()


@pytest.fixture(scope='module')
def header(element):
    """The header of a session, as values to be changed."""
    return json.loads(text(records.build_header(element, '/mlmem', {'record.hash_every': 500})))


def test_records_that_were_written_are_read(element, header):
    read = read_header(json.dumps(header))
    assert read.versions['mlmem_ros'] == __version__
    assert (read.design, read.settings) == (element.design, element.settings)
    assert (read.parameters, read.hash_every) == ({'record.hash_every': 500}, 500)
    recorded = read_state_hash(text(records.build_state_hash(element)))
    assert recorded.tick == 0
    np.testing.assert_array_equal(recorded.v, element.chain.v)


@pytest.mark.parametrize(
    ('path', 'value', 'field'),
    [
        (('format',), 3, 'format'),
        (('design', 'N'), 10**9, 'design.N'),
        (('design', 'd'), 1e999, 'Infinity'),
        (('settings', 'time', 'tick'), 'x' * 10**6, 'tick'),
        (('settings', 'turbo'), {}, 'turbo'),
        (('parameters', 'record.hash_every'), 0, 'record.hash_every'),
        (('initial',), None, 'initial'),
    ],
    ids=lambda part: str(part)[:60],
)
def test_invalid_header_is_rejected_by_field(header, path, value, field):
    """What else is no header is in test_outside.py."""
    with pytest.raises(BagError, match=field) as caught, name_errors('~/session'):
        read_header(json.dumps(replace_value(header, path, value)))
    assert len(str(caught.value)) < 300


def test_tick_that_takes_a_minute_is_rejected(header):
    """An elastic substrate of 10^9 k_r and a tick of 10^4 time units do not go together."""
    values = replace_value(header, ('settings', 'time', 'tick'), 1e4)
    assert read_header(json.dumps(values))
    values['design'] = {**values['design'], 's_max': 1e9, 'substrate': 'elastic'}
    with pytest.raises(DecodeError, match=r'time\.tick must be at most 4\.476'):
        read_header(json.dumps(values))


@pytest.mark.parametrize(
    ('key', 'value'),
    [('hash', 'short'), ('v', [None]), ('v', ['0x1p99999']), ('v', ['nan']), ('tick', -1)],
    ids=str,
)
def test_invalid_hash_is_rejected_by_field(element, key, value):
    recorded = json.loads(text(records.build_state_hash(element)))
    with pytest.raises(DecodeError, match=f'{key} must be'):
        read_state_hash(json.dumps(recorded | {key: value}))


def session_of(header, stamped=(), hashes=()):
    """Return a session by the text of its header."""
    return SessionData('/mlmem', read_header(header), list(stamped), hashes=list(hashes))


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        (('ticks',), 10**400),
        (('chain', 'values', 'shape'), [10**9, 10**9]),
        (('calibration', 'left', 'delays'), [0.0] * 1000),
    ],
    ids=lambda part: str(part)[:60],
)
def test_invalid_state_is_rejected(header, path, value):
    made = session_of(json.dumps(replace_value(header, ('initial', *path), value)))
    with pytest.raises(BagError, match='the initial state in the session header: ') as caught:
        build_element(made)
    assert len(str(caught.value)) < 500


def test_implausible_tick_is_rejected(header):
    """10^15 ticks would take millennia."""
    with pytest.raises(BagError, match=f'from 0 to 1000000000; got {10**15}'):
        run_replay(session_of(json.dumps(header), [(10**15, SetStrain(0.0))]))
    assert run_replay(session_of(json.dumps(header), [(5, SetStrain(0.0))])).ticks == 6


def test_hash_of_another_element_is_rejected(header, element):
    recorded = read_state_hash(text(records.build_state_hash(element)))
    other = type(recorded)(1, recorded.hash, recorded.v[:10])
    with pytest.raises(BagError, match='the state hash of tick 1 must have N = '):
        run_replay(session_of(json.dumps(header), hashes=[other]))


def test_record_from_before_the_session_is_rejected(header):
    late = session_of(json.dumps(header), [(5, SetStrain(0.0))])
    with pytest.raises(BagError, match='with tick 5, and its header with 100') as caught:
        find_last_tick(late, first=100)
    assert caught.value.code == 'begins_in_the_middle'


# --- the shots of a survey -------------------------------------------------------------------


SAMPLES = np.array([[1e-5, -2e-5, np.nan], [3e-7, 0.0, np.nan]])
"""With a sample that an interruption took."""

TAKEN = Shot(End.RIGHT, 0.7, 1e-3, 40.0, 62.0, -0.009, 0.5, np.array([0.1, -0.2]), SAMPLES)


def test_shot_comes_back_with_its_gaps():
    found = decode_shot(encode_shot(None, TAKEN), SHOT_HEAD_SIZE)
    for name in ('end', 'omega_c', 'A', 'sigma', 'wall', 'strain', 'dt'):
        assert getattr(found, name) == getattr(TAKEN, name)
    assert np.array_equal(found.rest, TAKEN.rest)
    assert np.array_equal(found.samples, SAMPLES, equal_nan=True)


@pytest.mark.parametrize(
    ('place', 'value'),
    [(1, 0.0), (3, -40.0), (4, np.nan), (7, np.inf), (SHOT_HEAD_SIZE, np.inf)],
)
def test_impossible_shot_is_rejected(place, value):
    data = encode_shot(None, TAKEN)
    data[place] = value
    with pytest.raises(ValueError, match=r'above 0|must be finite'):
        decode_shot(data, SHOT_HEAD_SIZE)


@pytest.mark.parametrize(
    ('kept', 'offset'), [(None, 0), (-1, SHOT_HEAD_SIZE), (SHOT_HEAD_SIZE, SHOT_HEAD_SIZE)]
)
def test_shot_without_two_whole_rows_is_rejected(kept, offset):
    with pytest.raises(ValueError, match='2 rows of samples'):
        decode_shot(encode_shot(None, TAKEN)[:kept], offset)
