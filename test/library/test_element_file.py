# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element file holds everything about one element; the shipped ones are in config/. A file is
replaced whole or not at all; a failure leaves nothing behind.
"""

import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import yaml
from suite import expect_rejection

import mlmem
from mlmem import ELEMENT_NAMES, Settings, atomic_files, element_file, load_element
from mlmem.atomic_files import make_directory, write_atomically
from mlmem.element_file import Element, ElementFileError
from mlmem.moves.kick import KickSettings
from mlmem.physics import Specimen
from mlmem.settings import ElementSettings

CONFIG = Path(__file__).parents[2] / 'config'

DIGESTS = {
    'case_1': '9e85e83b40c9bc24',
    'case_2': 'e46df86d16368f3b',
    'byte': '3207f8c2c23b66e1',
    'bits_1': 'a91f3a714eb19093',
    'bits_2': '443155a4fc6d7b9f',
    'bits_4': '826e2ef43b62ef37',
    'register_4': '93fcd81613a0d391',
    'register_5': 'e788e80575dc3ff4',
    'kick_2': '0db73cfe600c0e27',
    'kick_4': 'd646cce093407669',
    'robust_2': 'd0e38b596f4a944e',
    'robust_3': '83ced6d36347d259',
    'robust_2_friction': '8be56612e451564f',
    'robust_3_friction': '27a2670c09b0d496',
    'robust_3_one_end': 'c8062efdd905d4d7',
    'robust_words': '015667e8241d10be',
}
"""Hashes of every bit of the shipped elements: a number that changes is changed on purpose."""

SMALL = """\
format: 1
design: {N: 81, gamma: -3e-5, beta: -0.05, J: 9, J_s: 18, j_0: 6.84, d: 0.038}
kick:
  late: 0.5
  speeds: [0.002, 0.004]
"""


def load_text(folder, text):
    path = folder / 'mine.yaml'
    path.write_text(text, encoding='utf-8')
    return mlmem.load_element(path)


@pytest.mark.parametrize('name', ELEMENT_NAMES)
def test_shipped_element_has_same_bits_and_repeats_no_default(name):
    """Only a choice that both ends share may stand in its file and equal its default."""
    element = mlmem.load_element(name)
    assert element.name == name
    text = json.dumps(element.as_dict(), sort_keys=True)
    assert hashlib.blake2b(text.encode(), digest_size=8).hexdigest() == DIGESTS[name]
    assert element.specimen.is_ideal
    values = yaml.safe_load((CONFIG / f'{name}.yaml').read_text(encoding='utf-8'))
    assert element.as_dict() == values


def test_every_file_of_element_is_shipped():
    found = {file.stem for file in CONFIG.glob('*.yaml')} - {'example', 'sros2_policy'}
    assert found == set(ELEMENT_NAMES)


def test_element_file_sets_only_what_it_names(tmp_path):
    element = load_text(tmp_path, SMALL + 'probe_right: {sigma: 16}\n')
    assert element.name == 'mine'
    assert element.design.gamma == -3e-5  # as ROS reads it; YAML 1.1 asks for a point
    assert element.settings.kick == KickSettings('0.002 0.004', late=0.5)
    assert element.settings.probe_right == replace(Settings().probe_right, sigma=16.0)
    assert element.settings.write == Settings().write


def test_element_file_keeps_fitted_element_with_settings(tmp_path):
    design, settings = load_element('bits_2').design_and_settings
    alpha = 1.0 + 0.01 * np.random.default_rng(1).standard_normal(design.N)
    made = Specimen(design, alpha, k_r_factor=0.99, stuck=(45,))
    settings = replace(settings, element=ElementSettings('45'))
    path = tmp_path / 'leg.yaml'
    fit = {'time_unit': 1.01, 'chi2': 1.1, 'data': 99, 'undetermined': ('scatter',)}
    saved = Element(made, 1e-4 * alpha, settings=settings, **fit)
    element_file.write_element_file(path, saved)
    element = mlmem.load_element(path)
    assert element.settings == settings
    assert element.specimen.stuck == (45,)
    assert element.specimen.alpha == pytest.approx(made.alpha, rel=1e-12)
    assert {name: getattr(element, name) for name in fit} == fit
    simulated = mlmem.MemoryElement(element)  # as fitted
    assert simulated.settings == settings
    assert simulated.chain.specimen.alpha == pytest.approx(made.alpha)
    assert simulated.chain.specimen.masses == pytest.approx(1.01**-2)


@pytest.mark.parametrize(
    ('change', 'line', 'field', 'code'),
    [
        (('speeds: [0.002, 0.004]', 'speeds: 0.002'), 5, 'kick.speeds', 'out_of_range'),
        (('[0.002, 0.004]', '[0.002, 40]'), 5, 'kick.speeds', 'out_of_range'),
        (('late: 0.5', 'late: 2'), 4, 'kick.late', 'out_of_range'),
        (('late', 'latte'), 4, 'kick.latte', 'unknown_field'),
        (('J: 9', 'J: 90'), 2, 'design.J', 'conflict'),
        (('d: 0.038', 'eta: 0.1'), 2, 'design.d', 'missing_field'),
        (('format: 1', 'format: 2'), 1, 'format', 'out_of_range'),
        (('kick:', 'kik:'), 3, 'kik', 'unknown_field'),
        (('format: 1', 'alpha: [1.0, 2.0]\nformat: 1'), 1, 'alpha', 'conflict'),
        (('kick:', 'write: {tension: 0.2}\nkick:'), 3, 'write.tension', 'conflict'),
        (('kick:', 'transducers: {left: [0]}\nkick:'), 3, 'transducers.left',
         'unknown_field'),
        (('kick:', 'clearing_pulse: {A: 1.5}\nkick:'), 3, 'clearing_pulse.A', 'conflict'),
        (('late: 0.5', 'late: ]'), 4, '', 'malformed'),
        (('kick:', 'format: 1\nkick:'), 3, 'format', 'malformed'),
        (('d: 0.038', 'd: 0.038, d: 0.04'), 2, 'design.d', 'malformed'),
        (('kick:', 'plan: {steps: [{peak: 1, peak: 2}]}\nkick:'), 3, 'plan.steps.peak',
         'malformed'),
        (('format: 1', 'k_r: [1.0, 2.0]\nformat: 1'), 1, 'k_r', 'conflict'),
    ],
)  # fmt: skip
def test_wrong_element_file_names_line_and_key(tmp_path, change, line, field, code):
    with expect_rejection(ElementFileError, code, field) as refused:
        load_text(tmp_path, SMALL.replace(*change))
    said = str(refused.value)
    assert f'line {line}' in said
    assert 'mine.yaml' in said


def test_file_that_cannot_be_read_has_its_code(tmp_path):
    binary = tmp_path / 'binary.yaml'
    binary.write_bytes(b'\xff\xfe')
    for path in (tmp_path, binary):
        with expect_rejection(ElementFileError, 'unreadable'):
            mlmem.load_element(path)


@pytest.mark.parametrize(
    ('function', 'source'),
    [
        (mlmem.load_element, '~nobody-has-this-name/element.yaml'),
        (element_file.element_path, '~nobody-has-this-name/element.yaml'),
        (mlmem.load_element, 3),
        (mlmem.load_element, 'case_9'),
    ],
)
def test_element_that_is_neither_shipped_nor_a_path_is_rejected(function, source):
    with expect_rejection(ElementFileError, 'out_of_range', 'element') as refused:
        function(source)
    assert refused.value.value == source


def test_element_path_holds_in_another_folder(tmp_path, monkeypatch):
    (tmp_path / 'mine.yaml').write_text(SMALL)
    monkeypatch.chdir(tmp_path)
    assert element_file.element_path('mine.yaml') == str(tmp_path / 'mine.yaml')
    assert element_file.element_path('case_2') == 'case_2'


@pytest.mark.parametrize('number', ['1e6', '1.0e6', '.1E7', '+10.e+5'])
def test_element_file_number_has_any_exponent(tmp_path, number):
    element = load_text(tmp_path, f'{SMALL}\nscale: {{stiffness: {number}}}\n')
    assert element.settings.scale.stiffness == 1e6


def test_file_of_an_ideal_element_keeps_its_uncertainty():
    """Its cells are as designed, as far as a fit can say."""
    design = load_element('bits_1').design
    element = Element(Specimen(design), np.full(design.N, 1e-3))
    assert element.as_dict()['alpha_std'] == [1e-3] * design.N


def refuse(name):
    """Let a function of os fail for a while."""
    return patch.object(os, name, side_effect=OSError(28, 'No space left on device'))


def list_open_files(folder):
    """Return the files of a folder that are open; other threads may open others."""
    opened = [os.path.realpath(path) for path in Path('/proc/self/fd').iterdir()]
    return [path for path in opened if path.startswith(str(folder))]


@pytest.mark.parametrize('step', ['write', 'fsync', 'replace'])
def test_failed_write_leaves_the_old_content(tmp_path, step):
    file = tmp_path / 'file'
    write_atomically(file, 'old')
    with refuse(step), pytest.raises(OSError, match='No space left'):
        write_atomically(file, 'new')
    assert file.read_text() == 'old'
    assert list(tmp_path.iterdir()) == [file]
    assert not list_open_files(tmp_path)


def test_file_that_cannot_be_made_durable_is_closed(tmp_path):
    with refuse('fsync'), pytest.raises(OSError, match='No space left'):
        atomic_files.create_file(tmp_path / 'file')
    assert not list_open_files(tmp_path)


def test_file_closed_twice_closes_no_other(tmp_path):
    first = atomic_files.create_file(tmp_path / 'first')
    first.close()
    second = atomic_files.create_file(tmp_path / 'second')
    first.close()
    second.write(b'still open')
    second.close()


def test_new_directories_are_synced_into_their_parents(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr(atomic_files, 'sync_directory', synced.append)
    made = tmp_path / 'a' / 'b' / 'c'
    make_directory(made)
    assert {tmp_path, made.parent, made.parents[1]} <= set(synced)
    make_directory(made, exist_ok=True)
    (made / 'file').touch()
    for there, is_allowed in ((made, False), (made / 'file', True)):
        with pytest.raises(FileExistsError):
            make_directory(there, exist_ok=is_allowed)
