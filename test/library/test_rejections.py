# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is rejected says why by a code, and where by a field."""

import copy
import pickle

import pytest

from mlmem import (
    Faults,
    FollowTrajectory,
    Refused,
    SetFaults,
    SetMethod,
    Settings,
    SettingsError,
    Write,
    factory_calibration,
    load_element,
)
from mlmem.element import MemoryElement
from mlmem.loop.timetable import check_speed
from mlmem.parsing import DecodeError, decode_value, parse_json, parse_yaml, read_file
from mlmem.rejections import ErrorCode, Rejected
from mlmem.settings import ActuatorSettings, ElementSettings, RegisterSettings, WriteSettings


@pytest.fixture(scope='module')
def element():
    design, settings = load_element('bits_1').design_and_settings
    return MemoryElement(design, settings, factory_calibration(design, settings))


@pytest.mark.parametrize(
    ('make', 'code', 'field'),
    [
        (lambda: WriteSettings(ramp=-1.0), ErrorCode.OUT_OF_RANGE, 'ramp'),
        (lambda: WriteSettings(method='luck'), ErrorCode.OUT_OF_RANGE, 'method'),
        (
            lambda: Settings(write=WriteSettings(tension=0.2)),
            ErrorCode.CONFLICT, 'write.tension',
        ),
        (
            lambda: Settings(actuator=ActuatorSettings(present=False)),
            ErrorCode.CONFLICT, 'write.method',
        ),
        (
            lambda: Settings(
                element=ElementSettings('217'), register=RegisterSettings(spacing=1)
            ),
            ErrorCode.CONFLICT, 'element.bad_cells',
        ),
        (lambda: check_speed(-1.0), ErrorCode.OUT_OF_RANGE, 'time.speed'),
    ],
)  # fmt: skip
def test_settings_rejected_name_code_and_field(make, code, field):
    with pytest.raises(SettingsError) as rejected:
        make()
    assert (rejected.value.code, rejected.value.field) == (code, field)


@pytest.mark.parametrize(
    ('command', 'code', 'field'),
    [
        (SetMethod('luck'), ErrorCode.OUT_OF_RANGE, 'write.method'),
        (SetFaults(Faults(stuck_cell=1)), ErrorCode.CONFLICT, 'faults.stuck_cell'),
        (FollowTrajectory((), ()), ErrorCode.OUT_OF_RANGE, 'times'),
        (FollowTrajectory((1.0, 2.0), (0.0,)), ErrorCode.CONFLICT, 'strains'),
        (FollowTrajectory((1.0,), (0.0,), joint='knee'), ErrorCode.OUT_OF_RANGE, 'joint'),
        ('no command', ErrorCode.OUT_OF_RANGE, 'command'),
    ],
)
def test_commands_rejected_name_code_and_field(element, command, code, field):
    with pytest.raises(Refused) as rejected:
        element.apply(command)
    assert (rejected.value.code, rejected.value.field) == (code, field)


@pytest.mark.parametrize(
    ('make', 'code', 'field'),
    [
        (lambda: parse_json('{'), ErrorCode.MALFORMED, ''),
        (lambda: parse_yaml('a: [1'), ErrorCode.MALFORMED, ''),
        (lambda: read_file('/nowhere/at/all'), ErrorCode.UNREADABLE, ''),
        (lambda: decode_value(WriteSettings, {'ramp': 'x'}), ErrorCode.OUT_OF_RANGE, 'ramp'),
        (lambda: decode_value(WriteSettings, {'ramp': -1.0}, 'write'),
         ErrorCode.OUT_OF_RANGE, 'write.ramp'),
        (lambda: decode_value(WriteSettings, {'rump': 1.0, 'ramp': 2.0}, 'write'),
         ErrorCode.UNKNOWN_FIELD, 'write.rump'),
        (lambda: decode_value(Write, {}, 'command'), ErrorCode.MISSING_FIELD, 'command'),
        (lambda: decode_value(Settings, {'write': {'tension': 0.2}}),
         ErrorCode.CONFLICT, 'write.tension'),
    ],
)  # fmt: skip
def test_files_rejected_name_code_and_field(make, code, field):
    with pytest.raises(DecodeError) as rejected:
        make()
    assert (rejected.value.code, rejected.value.field) == (code, field)


def test_sentence_names_field_expected_and_value():
    rejected = Rejected.of_value(ErrorCode.OUT_OF_RANGE, 'kick.late', 2.0, 'from 0 to 1')
    assert str(rejected) == 'kick.late must be from 0 to 1; got 2.0'
    assert (rejected.value, rejected.expected) == (2.0, 'from 0 to 1')


def test_within_prefixes_field_and_sentence():
    inner = SettingsError.of_value(ErrorCode.CONFLICT, 'tension', 0.2, 'less')
    outer = Refused.within('write', inner)
    assert (outer.code, outer.field) == (ErrorCode.CONFLICT, 'write.tension')
    assert str(outer).startswith('write.tension must be less')


@pytest.mark.parametrize('again', [copy.copy, lambda error: pickle.loads(pickle.dumps(error))])
def test_rejection_keeps_code_in_another_process(again):
    for error in (
        SettingsError.of_value(ErrorCode.CONFLICT, 'a', 1, 'less'),
        DecodeError('no', 'kick.late', ErrorCode.MALFORMED),
    ):
        assert vars(again(error)) == vars(error)


def test_yaml_alias_counts_all_values_that_it_stands_for():
    """A few hundred bytes of aliases stand for ten million values."""
    lines = ['a0: &a0 [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]']
    lines += [f'a{n}: &a{n} [{", ".join([f"*a{n - 1}"] * 10)}]' for n in range(1, 7)]
    assert parse_yaml('\n'.join(lines[:3]))['a2'][9][9] == [0] * 10
    with pytest.raises(DecodeError) as rejected:
        parse_yaml('\n'.join(lines))
    assert rejected.value.code is ErrorCode.MALFORMED
