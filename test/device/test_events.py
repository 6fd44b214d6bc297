# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Outcomes as plain values for the answer of a service."""

import json
import math

from mlmem_ros.device import Outcome, Reading, describe_level


def test_an_outcome_becomes_plain_values():
    reading = Reading(5, '101', 'left', 694.25004, 0.93841234, 2.14264321, 149.0)
    outcome = Outcome('write', True, '', reading, 2, 100, 368)
    assert json.loads(json.dumps(outcome.as_dict())) == {
        'procedure': 'write', 'level': 5, 'code': '101', 'delay': 694.25,
        'level_margin': 0.9384, 'threshold_margin': 2.1426, 'confidence': 0.5333, 'end': 'left',
        'attempts': 2, 'ticks': 268,
    }  # fmt: skip


def test_the_readings_of_both_ends_are_reported():
    reading = Reading(5, '101', 'both', 694.25, 0.9, 2.1, 149.0, walls=2, right_delay=84.12344)
    values = Outcome('read', True, '', reading, 1, 0, 60).as_dict()
    assert (values['delay'], values['right_delay'], values['walls']) == (694.25, 84.1234, 2)


def test_a_failure_is_reported_with_its_reason_and_without_infinity():
    reading = Reading(-2, '', 'left', None, 0.0, 0.5, math.inf, 'no echo came back')
    values = Outcome('read', False, 'no echo came back', reading, 1, 7, 9).as_dict()
    assert values['error'] == values['reason'] == 'no echo came back'
    assert values['delay'] is None
    json.dumps(values, allow_nan=False)


def test_an_outcome_without_a_reading_is_short():
    values = Outcome('abort', True, '', None, 1, 3, 8).as_dict()
    assert values == {'procedure': 'abort', 'attempts': 1, 'ticks': 5}


def test_levels_are_described_in_words():
    assert [describe_level(n) for n in (-2, -1, 0, 7)] == [
        'undecodable', 'blank', 'level 0', 'level 7'
    ]  # fmt: skip
