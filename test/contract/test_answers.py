# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an answer holds is declared once: every shape that it takes follows."""

import json
import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest
from rclpy.parameter import parameter_value_to_python

from mlmem import Outcome, Reading
from mlmem.readers.reading import find_failure_code
from mlmem_ros.contract import answers
from mlmem_ros.contract.answers import Decoded, describe_fields
from mlmem_ros.contract.requests import build_parameter
from mlmem_ros.contract.streams import describe_outcome
from mlmem_tools.cli import request


def test_outcome_becomes_plain_values():
    reading = Reading(5, '101', 'left', 694.25004, 0.93841234, 2.14264321, 149.0)
    outcome = Outcome(reading, 2, procedure='write', start_tick=100, end_tick=368)
    assert json.loads(answers.format_answer(outcome, asked=5)) == {
        'procedure': 'write', 'level': 5, 'code': '101', 'delay': 694.25, 'asked': 5,
        'level_margin': 0.9384, 'margin': 0.9384, 'threshold_margin': 2.1426,
        'confidence': 0.5333, 'end': 'left', 'attempts': 2, 'ticks': 268,
    }  # fmt: skip
    reading = replace(reading, end='both', walls=2, right_delay=84.12344)
    values = answers.outcome_to_dict(Outcome(reading, procedure='read', end_tick=60))
    assert (values['delay'], values['right_delay'], values['walls']) == (694.25, 84.1234, 2)


def test_failure_is_reported_without_infinity():
    reading = Reading(-2, '', 'left', None, 0.0, 0.5, math.inf, 'no echo came back')
    outcome = Outcome(
        reading, code=find_failure_code(reading), error='no echo came back', procedure='read'
    )
    found = answers.outcome_to_dict(outcome)
    assert found['error'] == found['reason'] == 'no echo came back'
    assert found['delay'] is None
    json.dumps(found, allow_nan=False)
    assert 'delay' not in describe_outcome(None, outcome).values


@pytest.mark.parametrize('text', ['', 'ok', '[]', '{"procedure": "read", "level": 1}'])
def test_malformed_answer_is_a_failed_request(text):
    with pytest.raises(answers.RequestFailed):
        answers.parse_answer(Decoded, True, text)


# --- a field more -----------------------------------------------------------------------------

READING = Reading(5, '101', 'both', 694.25, 0.9, 2.5, 149.0, right_delay=84.125)


def result_type(kind):
    """Return what stands for the type of an action whose result has all that `kind` holds."""
    fields = {
        name: {'float64': 0.0, 'string': '', 'float64[]': []}.get(row.wire, 0)
        for answer, row in describe_fields(kind)
        for name, _ in answers.wire_fields(answer, row)
    }

    def result(**given):
        return SimpleNamespace(**{**fields, 'REFUSED': 2, **given})

    return SimpleNamespace(Result=result)


def test_field_declared_once_is_in_every_answer(monkeypatch):
    @dataclass(frozen=True)
    class Warmed(Decoded):
        """Decoded, with a temperature for each end, and one of the substrate."""

        warmth: float | None = answers.declare_field(
            'float64', 'of it', 'K', default=None, absent=math.nan
        )
        warmths: dict[str, tuple[float, ...]] = answers.declare_field(
            'float64[]', 'ends', 'K', default=None
        )

    monkeypatch.setitem(answers.ANSWER_TYPES, 'read', Warmed)
    measured = {'warmth': 293.5, 'warmths': {'left': [1.0, 2.0], 'right': [3.0]}}
    outcome = Outcome(READING, procedure='read', end_tick=60, found=measured)
    texts = describe_outcome(None, outcome).values
    assert (texts['warmth'], texts['warmths_left']) == ('293.5', '1 2')
    by_service = answers.parse_answer(Warmed, True, answers.format_answer(outcome))
    result = answers.build_result(result_type(Warmed), outcome=outcome)
    assert (result.warmth, result.left_warmths, result.right_warmths) == (293.5, [1.0, 2.0], [3.0])
    by_action = answers.parse_result('read', Warmed, result, SimpleNamespace())
    for answer in (by_service, by_action):
        assert (answer.warmth, answer.warmths['right'], answer.level) == (293.5, (3.0,), 5)
        assert 'warmth 293.5' in request._format_found(answer)
    assert [name for name, _ in describe_fields(Warmed)][-2:] == ['warmth', 'warmths']


@pytest.mark.parametrize(
    ('reading', 'delays'),
    [(READING, {'left': (1.5, 2.5)}), (None, {'left': (1.5,)}), (READING, {})],
)
def test_result_of_an_action_says_what_the_service_says(reading, delays):
    outcome = Outcome(reading, procedure='calibrate', end_tick=60, delays=delays)
    result = answers.build_result(result_type(answers.Calibrated), outcome=outcome)
    assert (result.left_delays, result.right_delays) == (list(delays.get('left', ())), [])
    said = answers.extract_values('calibrate', result)
    assert said.items() >= (
        json.loads(answers.format_answer(outcome)).items() if reading else set()
    )
    assert said.get('level') == (5 if reading else None)


def test_outcome_of_a_register_has_a_word_and_no_level():
    outcome = Outcome(READING, procedure='read', end_tick=60, content_name='word')
    assert (outcome.word, outcome.level) == (5, None)
    by_service = answers.parse_answer(Decoded, True, answers.format_answer(outcome))
    result = answers.build_result(result_type(Decoded), outcome=outcome)
    assert (result.word, result.level) == (5, -2)
    by_action = answers.parse_result('read', Decoded, result, SimpleNamespace())
    for answer in (by_service, by_action):
        assert (answer.word, answer.level, answer.content) == (5, None, 5)
        assert request._format_found(answer).startswith('word 5 (0x5) (code 101)')


def test_value_absent_from_a_result_is_none():
    result = answers.build_result(result_type(Decoded), 1, 'no echo')
    assert (result.level, result.word, result.walls) == (-2, -2, -1)
    assert math.isnan(result.delay)
    assert math.isnan(result.right_delay)
    found = answers.extract_values('read', result)
    assert found.items() >= {'delay': None, 'error': 'no echo'}.items()
    assert {'walls', 'right_delay', 'reason'}.isdisjoint(found)


def test_line_of_the_command_has_every_declared_field():
    outcome = Outcome(READING, procedure='read', end_tick=60)
    answer = answers.parse_answer(Decoded, True, answers.format_answer(outcome))
    line = request._format_decoded(answer)
    assert line.startswith('level 5 (code 101), end both, delay 694.2, ')
    for name, row in describe_fields(Decoded):
        if name in Decoded.__annotations__ and getattr(answer, name) not in (None, '', 5, '101'):
            assert f', {row.short or name} '.replace('_', ' ') in line, name


# --- what a message's field cannot hold is refused -------------------------------------------


@pytest.mark.parametrize(
    ('kind', 'accepted', 'rejected'),
    [
        (int, (-(2**63), 2**63 - 1), (-(2**63) - 1, 2**63, True, 2.5, '3', None, [3])),
        (float, (1, -2.5, math.inf), (True, '3', None, 10**400)),
        (bool, (True, False), (0, 1, 'true', None)),
        (str, ('', 'left'), (3, b'left', None, 'a\0b')),
        (tuple[float, ...], ([], [1, 2.5]), (3.0, 'abc', None, [0.0, 'x'])),
    ],
)
def test_value_that_a_parameter_cannot_hold_is_rejected(kind, accepted, rejected):
    for value in accepted:
        message = build_parameter('it', value, kind)
        assert parameter_value_to_python(message.value) == value
    for value in rejected:
        with pytest.raises(ValueError, match=r'^it'):
            build_parameter('it', value, kind)
