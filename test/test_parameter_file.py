# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's parameter file, read without ROS and as strictly as by the node."""

import dataclasses
import json
import time
from pathlib import Path

import numpy as np
import pytest
import yaml

from mlmem import PRESETS, Settings, SettingsError, element_file, preset
from mlmem.move_settings import EraseSettings, WriteSettings
from mlmem.physics import CASE_II, DesignError, Specimen
from mlmem_ros.host.settings import declare_parameters, default_groups
from mlmem_ros.parameter_file import (
    ParameterFileError,
    build_node_parameters,
    format_preset,
    load_preset,
    parse_preset,
)
from mlmem_tools import checks
from mlmem_tools.cli.main import main

CONFIG = Path(__file__).parent.parent / 'config'

MINE = """
/**:
  ros__parameters:
    design: {preset: case_2, N: 150, gamma: -2e-4}   # an exponent with no point, as ROS reads it
    write:
      tension: 0.05
    time.speed: 0.0
    publish: {field_every: 5}
/mlmem:
  ros__parameters:
    write.attempts: 5
    write.tension: 0.06                                # a name is nearer than /**
    use_sim_time: true
"""


def wrapped(text):
    return f'/**:\n  ros__parameters:\n    {text}\n'


def test_a_file_changes_only_what_it_names():
    design, settings = parse_preset(MINE)
    assert (design.N, design.gamma, design.J) == (150, -2e-4, CASE_II.J)
    assert (settings.write.tension, settings.write.attempts) == (0.06, 5)
    assert settings.erase == preset('case_2').settings.erase


@pytest.mark.parametrize('name', PRESETS)
def test_a_preset_is_loaded_by_its_name_and_from_its_file(name):
    assert load_preset(name) == preset(name)
    assert parse_preset(format_preset(*preset(name))) == preset(name)


def test_a_file_overrides_part_of_its_preset():
    design, settings = parse_preset(
        wrapped('{design: {preset: bits_4, N: 216}, write: {hold: 60.0}}')
    )
    assert design == dataclasses.replace(preset('bits_4').design, N=216)
    assert settings.write.hold == 60.0
    assert settings.write.ramp == preset('bits_4').settings.write.ramp
    assert settings.probe_right == preset('bits_4').settings.probe_right


def test_the_example_repeats_no_default():
    """Every line of it changes something."""
    said = yaml.safe_load((CONFIG / 'example.yaml').read_text())['/**']['ros__parameters']
    base = default_groups(preset(said['design'].pop('preset')))
    assert all(
        getattr(base[group], name) != value
        for group, values in said.items()
        for name, value in values.items()
    )
    load_preset(str(CONFIG / 'example.yaml'))


def test_a_launch_file_accepts_a_preset_or_a_file(tmp_path, monkeypatch):
    """A file as `mlmem design --output` writes it, relative to the working folder."""
    assert build_node_parameters('bits_4') == {'design.preset': 'bits_4'}
    file = tmp_path / 'mine.yaml'
    file.write_text(format_preset(*preset('bits_4')))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('HOME', str(tmp_path))
    for given in (str(file), 'mine.yaml', './mine.yaml', '~/mine.yaml'):
        assert build_node_parameters(given) == str(file)
    with pytest.raises(ParameterFileError, match=r"element must be .* case_1, .*; got 'case_3'"):
        build_node_parameters('case_3')


def test_a_path_is_a_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'fast.yaml').write_text(wrapped('write: {tension: 0.05}'))
    assert load_preset('fast.yaml')[1].write.tension == 0.05
    with pytest.raises(ParameterFileError, match='give a parameter file'):
        load_preset('slow')


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (wrapped('write: {tention: 0.05}'), ['no parameter write.tention', 'write.tension?']),
        (wrapped('color: red'), ['no parameter color']),
        (wrapped('write: {tension: 1}'), ['write.tension', 'decimal point', "'1'"]),
        (wrapped('write: {tension: strong}'), ['write.tension', 'a double', "'strong'"]),
        (wrapped('write: {attempts: 2.5}'), ['write.attempts', 'an integer', "'2.5'"]),
        (wrapped('write: [1, 2]'), ['write must be one value']),
        (wrapped('design: {preset: case_9}'), ['design.preset', 'case_1, case_2', "'case_9'"]),
        ('a: [', ['must be YAML']),
        ('a: "\\UFFFFFFFF"', ['must be YAML']),
        ('', ['/**', 'ros__parameters']),
        ('write: {tension: 0.05}', ['ros__parameters']),
        ('/a: {ros__parameters: {}}\n/b: {ros__parameters: {}}', ['one node', '/a, /b']),
    ],
)
def test_a_bad_file_is_named_with_what_is_wrong(text, words):
    with pytest.raises(ParameterFileError) as refused:
        parse_preset(text, 'my.yaml')
    for word in ['my.yaml', *words]:
        assert word in str(refused.value)
    assert '\n' not in str(refused.value)


@pytest.mark.parametrize(
    ('text', 'error', 'words'),
    [
        (wrapped('write: {tension: 0.9}'), SettingsError, 'tension must be'),
        (wrapped('write: {tension: .nan}'), SettingsError, 'tension must be .* got nan'),
        (wrapped('write: {tension: 0.2}'), SettingsError, 'within actuator.max_strain'),
        (wrapped('design: {N: 20}'), DesignError, 'J must be at most N - tail - 1 = 19'),
    ],
)
def test_a_value_out_of_range_is_refused(text, error, words):
    with pytest.raises(error, match=words):
        parse_preset(text, 'my.yaml')


# --- mlmem design check ----------------------------------------------------------------------


def test_a_file_passes_its_check_quickly(capsys, tmp_path):
    """A node can afford it when it is configured: once the loops are compiled, 0.6 s here."""
    file = tmp_path / 'my.yaml'
    file.write_text(wrapped('design: {preset: bits_1, eta: 0.00398}'))  # nothing of it is known
    begin = time.process_time()
    assert main(['design', 'check', str(file)]) == 0
    assert time.process_time() - begin < 2.0
    shown = capsys.readouterr().out
    assert 'peierls_nabarro' in shown
    assert ' 0 failed, 0 with a warning' in shown


def test_a_failed_check_ends_with_status_1_and_lists_its_findings(tmp_path, capsys, monkeypatch):
    """All as JSON; in brief those that did not pass."""
    monkeypatch.setattr(checks, 'CHECK_MODULES', (checks.material,))
    file = tmp_path / 'my.yaml'
    file.write_text(wrapped('probe: {omega_c: 2.4}'))
    assert main(['design', 'check', str(file), '--json']) == 1
    report = json.loads(capsys.readouterr().out)
    assert report['verdict'] == 'fail'
    verdicts = {finding['name']: finding['verdict'] for finding in report['findings']}
    assert (verdicts['carrier_left'], verdicts['wall_width']) == ('fail', 'pass')
    assert main(['design', 'check', str(file), '--brief']) == 1
    shown = capsys.readouterr().out
    assert 'carrier_left' in shown
    assert 'wall_width' not in shown


@pytest.mark.parametrize(
    ('text', 'status', 'words'),
    [
        (None, 2, 'No such file or directory; give a parameter file, or one of case_1, case_2'),
        ('nothing', 2, 'ros__parameters'),
        (wrapped('design: {N: 20}'), 1, 'J must be at most N - tail - 1'),
    ],
)
def test_files_that_cannot_be_checked(tmp_path, capsys, text, status, words):
    file = tmp_path / 'my.yaml'
    if text is not None:
        file.write_text(text)
    assert main(['design', 'check', str(file)]) == status
    message = capsys.readouterr().err
    assert message.startswith('mlmem design: ')
    assert words in message


def test_a_written_parameter_file_is_read_back():
    design = dataclasses.replace(CASE_II, N=250, eta=1e-3, gamma=-1e-5, substrate='elastic')
    settings = Settings(
        write=WriteSettings(tension=0.04, attempts=5), erase=EraseSettings(settle=1e5)
    )
    assert parse_preset(format_preset(design, settings)) == (design, settings)
    assert format_preset(*preset('case_2')).split() == [
        '/**:',
        'ros__parameters:',
        'design:',
        'preset:',
        'case_2',
    ]


# --- the file of an individual element -------------------------------------------------------


DESIGN = preset('bits_1').design


def test_an_element_survives_its_file(tmp_path):
    alpha = 1.0 + 0.01 * np.random.default_rng(1).standard_normal(DESIGN.N)
    made = Specimen(DESIGN, alpha, k_r_factor=0.99, mass=1.01, offset=0.002)
    element_file.write_element_file(tmp_path / 'e.yaml', element_file.Element(made, 1e-4 * alpha))
    again = element_file.read_element_file(tmp_path / 'e.yaml')
    assert again.specimen.design == DESIGN
    for name in ('alpha', 'k_r', 'masses', 'offsets'):
        assert getattr(again.specimen, name) == pytest.approx(getattr(made, name), rel=1e-12)


@pytest.mark.parametrize(
    ('text', 'reason'),
    [('', 'it must be an object; got nothing'), ('format: 2', 'it lacks design'),
     ('{', 'e.yaml'), ('{format: 1, design: {N: 5}}', 'design lacks gamma')],
)  # fmt: skip
def test_a_file_that_is_no_element_is_named(tmp_path, text, reason):
    (tmp_path / 'e.yaml').write_text(text, encoding='utf-8')
    with pytest.raises(element_file.ElementFileError, match=reason):
        element_file.read_element_file(tmp_path / 'e.yaml')


def test_dump_of_a_default_node_is_loaded_as_its_element():
    """`ros2 param dump` names every declared parameter, and those of rclpy."""
    dumped = {name: value for name, value, _ in declare_parameters()}
    dumped |= {
        'use_sim_time': False,
        'start_type_description_service': True,
        'qos_overrides./clock.subscription.depth': 1,
    }
    assert parse_preset(yaml.safe_dump({'/mlmem': {'ros__parameters': dumped}})) == preset(
        'case_2'
    )
