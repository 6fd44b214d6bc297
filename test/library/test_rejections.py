# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is rejected says why by a code, and where by a field; every setting is checked."""

import copy
import math
import pickle
from dataclasses import fields, make_dataclass, replace

import numpy as np
import pytest
import rig
from suite import expect_rejection

from mlmem import (
    Calibration,
    DelayTable,
    DesignError,
    Disturb,
    Faults,
    Refused,
    Reset,
    SetFaults,
    SetMethod,
    Settings,
    SettingsError,
    Write,
    factory_calibration,
    load_element,
)
from mlmem.element import MemoryElement
from mlmem.errors import ErrorCode
from mlmem.law_file import LawFileError, read_law_file
from mlmem.loop.timetable import check_speed
from mlmem.moves.kick import KickSettings
from mlmem.parsing import DecodeError, decode_value, parse_json, parse_yaml, read_file
from mlmem.physics import CASE_II, Specimen, StateError
from mlmem.schema import (
    describe_field,
    find_descriptions,
    find_problems,
    make_printable,
    short_repr,
)
from mlmem.settings import (
    ActuatorSettings,
    ElementSettings,
    ProbeSettings,
    RegisterSettings,
    WriteSettings,
)
from mlmem.snapshot import restore_snapshot, take_snapshot

ROBUST = load_element('robust_words').settings
KICKED = load_element('kick_2').settings

SHORT = replace(CASE_II, N=75)
THREE = DelayTable((1.0, 2.0, 3.0))
NO_BAND = Settings(probe=ProbeSettings(omega_c=2.4))
"""The printed carrier lies above both pass bands: nothing comes back."""

ALL_ECHO = Settings(probe=ProbeSettings(v_th=1e-9))
"""The threshold is below the ring-down."""

REJECTED = {
    SettingsError: [
        (lambda: WriteSettings(ramp=-1.0), 'out_of_range', 'ramp'),
        (lambda: WriteSettings(method='luck'), 'out_of_range', 'method'),
        (lambda: Settings(actuator=ActuatorSettings(present=False)), 'conflict', 'write.method'),
        (lambda: Settings(element=ElementSettings('217'), register=RegisterSettings(spacing=1)),
         'conflict', 'element.bad_cells'),
        (lambda: replace(ROBUST, register=RegisterSettings(), element=ElementSettings('40')),
         'conflict', 'read.method'),
        (lambda: check_speed(-1.0), 'out_of_range', 'time.speed'),
        *(
            (lambda name=name: rig.shipped(name, read={'method': 'records', 'end': 'left'}),
             code, field)
            for name, code, field in (
                ('robust_2', 'unsupported', 'read.method'),
                ('robust_2_friction', 'unsupported', 'read.method'),
                ('case_2', 'conflict', 'actuator.present'),
            )
        ),
        # a register without a kick to each level
        (lambda: rig.shipped('byte', kick={'speeds': '0.1 0.2'}), 'conflict', 'kick.speeds'),
        (lambda: rig.shipped('byte', kick={'kinks': '0' + 7 * ' 0.1'}), 'conflict', 'kick.kinks'),
        *(
            (lambda kinks=kinks: KickSettings(kinks=kinks), 'out_of_range', 'kinks')
            for kinks in ('0.1 fast', 'nan')
        ),
        # a calibration of another element, and elements that cannot be calibrated
        (lambda: MemoryElement(CASE_II, Settings(), Calibration(THREE, THREE)),
         'conflict', 'left'),
        (lambda: factory_calibration(SHORT, NO_BAND), 'unsupported', 'level'),
        (lambda: factory_calibration(SHORT, ALL_ECHO), 'conflict', 'delays'),
        (lambda: factory_calibration(replace(SHORT, beta=0.3), Settings()),
         'unsupported', 'level'),  # with beta > 0 a defect is a hill, not a hollow
        # kicked, a pulse is 5 times as great: beyond the greatest amplitude, 0.5
        (lambda: replace(KICKED, probe=replace(KICKED.probe, A=0.2)), 'conflict', 'probe.A'),
        *(
            (lambda twin=twin: MemoryElement(load_element('bits_1')).adopt_twin(twin),
             'conflict', 'twin')
            for twin in (Specimen(CASE_II), CASE_II, 'x')
        ),
    ],
    DesignError: [
        (lambda wrong=wrong: MemoryElement(wrong), 'out_of_range', 'material')
        for wrong in ('kick_2', None, Settings())
    ],
    StateError: [
        (lambda name=name, wrong=wrong: MemoryElement(load_element(name)).place_content(wrong),
         'out_of_range', 'content')
        for name in ('bits_1', 'robust_2') for wrong in (99, -2)
    ],
    Refused: [
        *(
            (lambda faults=faults: MemoryElement(load_element('bits_1')).apply(SetFaults(faults)),
             'out_of_range', 'faults')
            for faults in ('x', None, {'seed': 1})
        ),
        (lambda: MemoryElement(load_element('bits_1')).apply(SetMethod('luck')),
         'out_of_range', 'write.method'),
    ],
    DecodeError: [
        *(
            (lambda text=text: parse_json(text), 'malformed', '')
            for text in ('{', '', '[' * 10**6, 'NaN', '9' * 5000)
        ),
        (lambda: parse_yaml('a: [1'), 'malformed', ''),
        (lambda: read_file('/nowhere/at/all'), 'unreadable', ''),
        (lambda: decode_value(WriteSettings, {'ramp': 'x'}), 'out_of_range', 'ramp'),
        (lambda: decode_value(WriteSettings, {'ramp': -1.0}, 'write'),
         'out_of_range', 'write.ramp'),
        (lambda: decode_value(WriteSettings, {'rump': 1.0, 'ramp': 2.0}, 'write'),
         'unknown_field', 'write.rump'),
        (lambda: decode_value(tuple[str, ...], 'text', 'names'), 'out_of_range', 'names'),
        (lambda: decode_value(Write, {}, 'command'), 'missing_field', 'command.level'),
        (lambda: decode_value(Settings, {'write': {'tension': 0.2}}), 'conflict', 'write.tension'),
    ],
}  # fmt: skip


@pytest.mark.parametrize('kind', REJECTED)
def test_rejection_has_code_and_field(kind):
    for make, code, field in REJECTED[kind]:
        with expect_rejection(kind, code, field):
            make()


def test_perform_takes_procedures_alone():
    element = MemoryElement(load_element('bits_1'))
    with expect_rejection(Refused, 'out_of_range', 'command'):
        element.perform(Disturb(1e-4))
    assert element.is_still


def test_whole_number_of_numpy_is_one_of_python():
    """So that a command with it can be recorded."""
    for made, field in ((Write(np.int64(1)), 'level'), (Reset(seed=np.int8(1)), 'seed')):
        assert type(getattr(made, field)) is int
    element = MemoryElement(load_element('bits_1'))
    assert element.check_arguments(Write(np.uint8(1))) == {'level': 1}
    for wrong in (np.float64(1.0), np.bool_(True), True, '1'):
        with pytest.raises(Refused):
            element.check_arguments(Write(wrong))


def test_owner_and_place_stand_in_front_of_field_and_sentence():
    inner = SettingsError(ErrorCode.CONFLICT, 'tension', 0.2, 'less')
    outer = Refused.of_error(inner, 'write', place='a.yaml, line 3')
    assert (outer.code, outer.field) == (ErrorCode.CONFLICT, 'write.tension')
    assert str(outer) == 'a.yaml, line 3: write.tension must be less; got 0.2'
    outer = Refused.of_error(ValueError('too late'), 'write')
    assert (outer.code, outer.field) == (ErrorCode.OTHER, 'write')
    assert str(outer) == 'write: too late'


def test_annotation_that_is_a_type_is_checked():
    """A module without `from __future__ import annotations` stores the type itself."""
    plain = make_dataclass('Plain', [('size', int, describe_field(1, 'size'))])
    assert find_problems(plain()) == []
    assert find_problems(plain(1.5)) == [('size', 1.5, 'a whole number')]


def test_huge_value_is_clipped():
    texts, numbers = ['x' * 5_000_000, b'x' * 5_000_000], [10**4000, list(range(10**6))]
    deep = doubled = ['lol']
    for _ in range(100_000):
        deep = [deep]
    for _ in range(40):
        doubled = [doubled] * 2  # as YAML's aliases make it
    for value in (*texts, *numbers, {str(n): n for n in range(10**5)}, deep, doubled):
        length = len(short_repr(value))
        assert 3 <= length <= 80, type(value)


def test_no_text_controls_the_terminal():
    shown = make_printable('\x1b[2Jgone\nnext \ud800 größe [/red]')
    assert shown == '\\x1b[2Jgone\\nnext \\ud800 größe [/red]'
    assert shown.encode()
    assert len(make_printable('\n' * 5_000_000)) <= 1000


@pytest.mark.parametrize('again', [copy.copy, lambda error: pickle.loads(pickle.dumps(error))])
def test_rejection_keeps_code_in_another_process(again):
    for error in (
        SettingsError(ErrorCode.CONFLICT, 'a', 1, 'less'),
        DecodeError(ErrorCode.MALFORMED, 'kick.late', reason='no', place='a.yaml'),
    ):
        assert vars(again(error)) == vars(error)
        assert str(again(error)) == str(error)


@pytest.mark.parametrize(
    ('text', 'code', 'field'),
    [
        ('{format: 1, law: {low: 0.0, high: 1.0, force: 3}}', 'out_of_range', 'law.force'),
        ('{format: 1, law: {low: 0.0, high: 1.0, force: [1, 2]}}', 'out_of_range', 'law.force'),
        ('{format: 1, law: {low: 0.0, force: [1, 2]}}', 'missing_field', 'law.high'),
        ('{format: 1, unit: SI, unit: mm}', 'malformed', 'unit'),
        ('{format: 1', 'malformed', ''),
        (None, 'unreadable', ''),
    ],
)
def test_law_file_that_is_none_is_rejected_by_code_and_field(tmp_path, text, code, field):
    path = tmp_path / 'law.yaml'
    if text is not None:
        path.write_text(text)
    with expect_rejection(LawFileError, code, field) as rejected:
        read_law_file(path)
    assert rejected.value.place == str(path)


@pytest.mark.parametrize(
    ('change', 'code', 'field'),
    [
        ({'ticks': -1}, 'out_of_range', 'ticks'),
        ({'ticks': 1}, 'conflict', 'chain.steps'),
        ({'last_moved': 7}, 'conflict', 'last_moved'),
        ({'chain': None}, 'conflict', 'chain'),
        ({'strange': 1}, 'unknown_field', 'strange'),
        ({'design': CASE_II.as_dict()}, 'conflict', 'design'),
    ],
)
def test_snapshot_of_another_device_has_code_and_field(change, code, field):
    element = MemoryElement(load_element('bits_1'))
    taken = take_snapshot(element)
    with expect_rejection(StateError, code, field):
        restore_snapshot(element, taken | change)
    assert take_snapshot(element) == taken


def test_yaml_alias_counts_all_values_that_it_stands_for():
    """A few hundred bytes of aliases stand for ten million values."""
    lines = ['a0: &a0 [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]']
    lines += [f'a{n}: &a{n} [{", ".join([f"*a{n - 1}"] * 10)}]' for n in range(1, 7)]
    assert parse_yaml('\n'.join(lines[:3]))['a2'][9][9] == [0] * 10
    assert parse_yaml('a: 1', texts=True) == {'a': '1'}
    with expect_rejection(DecodeError, 'malformed'):
        parse_yaml('\n'.join(lines))


PEAKS = ('compression', 'tension', 'start_strain')


@pytest.mark.parametrize('peak', PEAKS)
@pytest.mark.parametrize('group', ['write', 'erase'])
def test_no_peak_may_exceed_actuators_limit(group, peak):
    """All other peaks are a tenth as great."""
    given = {name: getattr(Settings(), name) for name in ('write', 'erase')}
    for name, each in given.items():
        peaks = {peak: 0.1 * getattr(each, peak) for peak in PEAKS}
        given[name] = replace(each, **peaks)
    value = getattr(getattr(Settings(), group), peak)
    given[group] = replace(given[group], **{peak: value})
    Settings(actuator=ActuatorSettings(max_strain=abs(value)), **given)
    with expect_rejection(SettingsError, 'conflict', f'{group}.{peak}'):
        Settings(actuator=ActuatorSettings(max_strain=0.999 * abs(value)), **given)


@pytest.mark.parametrize(
    'owner', [*Settings().list_groups().values(), Faults()], ids=lambda owner: type(owner).__name__
)
def test_every_setting_is_described_and_bounded(owner):
    """Both bounds of a number are legal; whatever is beyond, or of another type, is rejected."""
    described = dict(find_descriptions(owner))
    assert list(described) == list(fields(owner))
    for field, row in described.items():
        value = getattr(owner, field.name)
        text = isinstance(value, str)
        wrong = ['nowhere', 7, None] if text else [math.nan, math.inf, 'x', None]
        bounded = not (row.choices or row.low is None)
        for bound, beyond in ((row.low, -math.inf), (row.high, math.inf)) if bounded else ():
            assert getattr(replace(owner, **{field.name: bound}), field.name) == bound
            step = 1 if beyond > 0 else -1
            whole = isinstance(bound, int)
            wrong.append(bound + step if whole else math.nextafter(bound, beyond))
        for bad in wrong:
            with expect_rejection(SettingsError, 'out_of_range', field.name):
                replace(owner, **{field.name: bad})
