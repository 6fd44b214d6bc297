# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the pages are those of the result files; stale results are listed."""

import json

import pytest

from mlmem_lab import numbers, results
from mlmem_lab.numbers import place_numbers


@pytest.fixture
def folder(tmp_path):
    result = {
        'on': 'EPYC', 'heat': 0.14239, 'reads': 38400, 'rare': 9.6e-5,
        'cases': {'first': {'speed': 1.9}},
    }  # fmt: skip
    (tmp_path / 'r.json').write_text(json.dumps(result))
    return tmp_path


@pytest.mark.parametrize(
    ('printed', 'path', 'expected'),
    [
        ('0.999', 'r/heat', '0.142'),
        ('1', 'r/reads', '38 400'),
        ('12 345', 'r/reads', '38 400'),
        ('1.0e-3', 'r/rare', '9.6e-5'),
        ('0.00', 'r/cases/first/speed', '1.90'),
        ('*a machine*', 'r/on', '*EPYC*'),
    ],
)
def test_placed_number_keeps_its_decimals(folder, printed, path, expected):
    text = place_numbers(f'of {printed}<!-- {path} --> units', folder)
    assert text == f'of {expected}<!-- {path} --> units'
    assert place_numbers(text, folder) == text


@pytest.mark.parametrize(
    'text',
    ['1<!-- r/none -->', '1<!-- other/heat -->', '1<!-- r/cases/second/speed -->',
     '1<!-- r/cases -->', '1<!-- r/on -->', '*one*<!-- r/heat -->'],
)  # fmt: skip
def test_comment_that_names_no_number_is_rejected(folder, text):
    with pytest.raises(ValueError, match=r'r/|other/'):
        place_numbers(text, folder)


def test_pages_and_pictures_match_the_committed_results(capsys):
    assert numbers.main(['--check']) == 0, capsys.readouterr().out


def test_page_with_another_number_is_named_and_corrected(tmp_path, folder, monkeypatch, capsys):
    page = tmp_path / 'README.md'
    page.write_text('0.5<!-- r/heat -->\n')
    monkeypatch.setattr(numbers, 'list_pages', lambda: [page])
    monkeypatch.setattr(numbers, 'CHECKOUT_ROOT', tmp_path)
    monkeypatch.setattr(numbers, 'RESULT_FOLDER', folder)
    monkeypatch.setattr(numbers, 'PICTURE_FOLDERS', ())
    assert numbers.main(['--check']) == 1
    assert 'README.md: 0.5<!-- r/heat -->\nmust be: 0.1<!-- r/heat -->' in capsys.readouterr().out
    assert numbers.main([]) == 0
    assert page.read_text() == '0.1<!-- r/heat -->\n'


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A checkout with one module, one picture and no pages."""
    for module in (results, numbers):
        monkeypatch.setattr(module, 'CHECKOUT_ROOT', tmp_path)
        monkeypatch.setattr(module, 'RESULT_FOLDER', tmp_path / 'lab' / 'results')
    monkeypatch.setattr(numbers, 'list_pages', list)
    picture = tmp_path / 'docs' / 'figures' / 'wall.png'
    for folder in (picture.parent, results.RESULT_FOLDER, tmp_path / 'device'):
        folder.mkdir(parents=True)
    (tmp_path / 'device' / 'wall.py').write_text('width = 9')
    picture.write_bytes(b'a wall')
    results.keep_picture(picture, 'mlmem figures wall', ['device'])
    return tmp_path


def list_stale(capsys):
    assert numbers.main(['--stale']) == 0
    return capsys.readouterr().out


def test_stale_result_is_listed_with_its_command_and_time(checkout, capsys):
    kept = {'seconds': 90_000, 'hashes': {'old': 'another hash'}}  # longer than tests run
    results.save_result(
        results.RESULT_FOLDER / 'r.json', {}, 'mlmem make', ['device'], ['new'], seed=1, kept=kept
    )
    assert list_stale(capsys) == 'r.json (old)\n    mlmem make (90000 s)\n'
    (checkout / 'device' / 'wall.py').write_text('"""In cells."""\n\nwidth = 9  # as printed')
    assert list_stale(capsys) == 'r.json (old)\n    mlmem make (90000 s)\n'
    (checkout / 'device' / 'wall.py').write_text('width = 11')
    listed = list_stale(capsys)
    assert listed.startswith('r.json\n    mlmem make (90000 s)\n')
    assert 'docs/figures/wall.png\n    mlmem figures wall (' in listed
    assert numbers.main(['--check']) == 0


def test_picture_with_other_bytes_is_named(checkout, capsys):
    picture = checkout / 'docs' / 'figures' / 'wall.png'
    assert numbers.main(['--check']) == 0
    picture.write_bytes(b'another wall')
    picture.with_name('stranger.png').write_bytes(b'unknown')
    assert numbers.main(['--check']) == 1
    found = capsys.readouterr().out
    assert 'wall.png: not the picture that "mlmem figures wall" drew' in found
    assert 'stranger.png: pictures.json names no command' in found
