# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies and benchmarks keep each result at once, pages show its numbers, a stale one is listed,
and the device does what it did when they were measured, to the bit.
"""

import importlib
import json
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem import MemoryElement, Read, Write, load_element
from mlmem_lab import numbers, results
from mlmem_lab import study as studies
from mlmem_lab.behaviour import behaviour_study, measure_case, run_trial
from mlmem_lab.bench import BENCHMARK_TITLES, command
from mlmem_lab.bench.measure import Contender, ResultTable, compare_costs, describe_processor
from mlmem_lab.bench.node import build_row, keep_column
from mlmem_lab.numbers import place_numbers
from mlmem_lab.study import STUDY_MODULES, Study, load_study, map_calls
from mlmem_tools.cli.main import main
from mlmem_tools.cli.output import create_console


def count_letters(case, seed, count=1):
    return count * len(case)


@pytest.fixture
def lengths(tmp_path, monkeypatch):
    """A study of the lengths of names, whose result file is in a folder of its own."""
    monkeypatch.setattr(results, 'RESULT_FOLDER', tmp_path)
    monkeypatch.setattr(results, 'hash_modules', lambda modules: ' '.join(modules))
    found = Study(
        'lengths', count_letters, ('case_2', 'bits_1', 'byte'), ('lab/lengths.py',), seed=3
    )
    monkeypatch.setitem(STUDY_MODULES, 'times', 'lengths')
    monkeypatch.setattr(studies, 'load_study', lambda name: found)
    return found


def run_study(*arguments):
    return main(['study', 'times', *arguments, '--jobs', '1'])


def test_study_keeps_the_cases_that_are_not_measured_again(lengths, monkeypatch):
    """Without cases it measures what is missing or stale."""
    assert run_study('bits_1', 'byte') == run_study('byte') == 0
    found = results.load_result(lengths.path)
    assert found['cases'] == {'bits_1': 6, 'byte': 4}
    modules = [*results.DEVICE_MODULES, 'lab/lengths.py']
    assert found['hashes'] == dict.fromkeys(['bits_1', 'byte'], ' '.join(modules))
    assert found['command'] == 'mlmem study lengths bits_1 byte'
    assert found['seed'] == 3
    assert lengths.list_missing() == ['case_2']
    assert run_study() == 0
    assert lengths.list_missing() == []
    monkeypatch.setattr(results, 'hash_modules', lambda modules: 'changed')
    assert lengths.list_missing() == list(lengths.cases)


def test_study_time_is_that_of_the_last_whole_run(lengths):
    run_study(*lengths.cases)
    kept = results.load_result(lengths.path) | {'seconds': 3600}
    lengths.path.write_text(json.dumps(kept))
    run_study('byte')
    assert results.load_result(lengths.path)['seconds'] == 3600
    run_study(*lengths.cases)
    assert results.load_result(lengths.path)['seconds'] < 3600


def test_count_is_given_only_to_a_study_that_takes_it(lengths, monkeypatch):
    assert run_study('byte', '--count', '3') == 2
    sized = replace(lengths, is_sized=True)
    monkeypatch.setattr(studies, 'load_study', lambda name: sized)
    assert run_study('byte', '--count', '3') == 0
    assert results.load_result(sized.path)['cases'] == {'byte': 12}


def test_study_of_an_unknown_case_is_refused(lengths, capsys):
    assert run_study('bits_9') == 2
    assert 'got bits_9' in capsys.readouterr().err
    assert not lengths.path.exists()


def test_calls_in_processes_keep_their_order():
    then = []
    console = create_console(aside=True)
    found = map_calls(console, 2, 'powers', pow, (2, 3, 4), (2, 2, 2), then=then.append)
    assert found == then == [4, 9, 16]


def list_used_files(module, found):
    """Return the files of the laboratory and the tools whose functions a module uses."""
    found.add(Path(module.__file__).relative_to(results.CHECKOUT_ROOT))
    for value in vars(module).values():
        name = getattr(value, '__module__', getattr(value, '__name__', None))
        file = getattr(sys.modules.get(name), '__file__', None) or ''
        path = Path(file.removeprefix(f'{results.CHECKOUT_ROOT}/'))
        is_ours = path.is_relative_to('lab/mlmem_lab') or path.is_relative_to('mlmem_tools')
        is_measured = path.stem not in ('study', 'results', 'style', 'draw')  # which run, or draw
        if is_ours and is_measured and path not in found:
            list_used_files(sys.modules[name], found)
    return found


@pytest.mark.parametrize('name', STUDY_MODULES)
def test_study_names_the_files_that_its_numbers_depend_on(name):
    """They are there; the committed result file is its own, and has cases that it has."""
    found = load_study(name)
    module = importlib.import_module(f'mlmem_lab.{STUDY_MODULES[name]}')
    for file in list_used_files(module, set()):
        assert any(file.is_relative_to(each) for each in found.modules), file
    assert all((results.CHECKOUT_ROOT / each).exists() for each in found.modules)
    assert found.name == name
    assert set(results.load_result(found.path)['hashes']) <= set(found.cases)


def test_figure_of_a_case_that_is_not_measured_is_refused(lengths, monkeypatch, capsys):
    run_study('byte')
    drawn = replace(lengths, draw=lambda result: result['cases']['case_2'])
    monkeypatch.setattr(studies, 'load_study', lambda name: drawn)
    assert main(['study', 'times', '--figure', 'none.png']) == 1
    assert "lacks 'case_2'" in capsys.readouterr().err


def test_ratios_are_taken_within_a_round():
    """The second takes twice as long in every round, whatever the machine does meanwhile."""
    contenders = [Contender(name, print, 1.0) for name in 'ab']
    costs = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0]])
    first, second = compare_costs(contenders, costs, 's')
    assert first == {'contender': 'a', 's': '2 ± 0.5', 'over a': '1 ± 0'}
    assert second == {'contender': 'b', 's': '4 ± 1', 'over a': '2 ± 0'}


@pytest.fixture
def modules_of_one_hash(monkeypatch):
    """Hash no modules: it takes a second, and the results are not kept."""
    monkeypatch.setattr(results, 'hash_modules', lambda modules: 'a hash')


def test_tables_are_kept_beside_others(modules_of_one_hash, tmp_path, monkeypatch):
    """Every benchmark is found by its name; that of others is refused."""
    for name in BENCHMARK_TITLES:
        assert callable(importlib.import_module(f'mlmem_lab.bench.{name}').run)
    assert main(['bench', 'x']) == 2
    found = ResultTable('K', 'all equal', [{'contender': 'a', 's': '1'}, {'contender': 'b'}])
    ours = SimpleNamespace(run=lambda repeats: found)
    loader = SimpleNamespace(import_module=lambda name, package: ours)
    monkeypatch.setattr(command, 'importlib', loader)  # others import modules meanwhile
    file = tmp_path / 'bench.json'
    for name in ('recorder', 'kernel'):
        assert main(['bench', name, '--result', str(file)]) == 0
    tables = json.loads(file.read_text(encoding='utf-8'))['tables']
    assert tables == {'recorder': found.rows, 'kernel': found.rows}


def test_result_of_a_node_has_a_column_for_every_processor(modules_of_one_hash, tmp_path):
    rows = [
        build_row('share of a core', 'at most 1', [0.2, 0.4, 0.3], 0.8),
        build_row('memory', '', [9], 0.1),
    ]
    file = tmp_path / 'node.json'
    keep_column(rows, file)
    kept = json.loads(file.read_text())['rows']
    (ours,) = kept[0].keys() - {'figure', 'goal'}
    assert [row['figure'] for row in kept] == ['date', *(row['figure'] for row in rows)]
    assert [row[ours] for row in kept[1:]] == ['0.3 (busy)', '9']  # medians
    assert kept[1]['goal'] == 'at most 1'
    file.write_text(json.dumps({'rows': [{**row, ours: '7', 'another': '8'} for row in kept]}))
    keep_column(rows, file)
    assert json.loads(file.read_text())['rows'] == [{**row, 'another': '8'} for row in kept]


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


@pytest.mark.parametrize('case', ['robust_words', 'case_2, simulated'])
def test_device_does_what_the_results_were_measured_with(case):
    result = results.load_result(behaviour_study.path)
    if result['processor'] != describe_processor():
        pytest.skip(f'the hashes are of another processor: {result["processor"]}')
    known, found = result['cases'][case], measure_case(case)
    assert found == known, (
        f'{[what for what in known if found.get(what) != known[what]]} do something else: if this '
        'is meant, run "mlmem study behaviour", and all studies that are stale then'
    )


def test_trial_hash_tells_a_change_that_no_reading_shows():
    shipped = load_element('kick_2')
    slower = replace(shipped.design, eta=shipped.design.eta * (1.0 + 1e-12))
    commands = Write(1), Read()
    same, other = (MemoryElement(design, shipped.settings) for design in (shipped.design, slower))
    expected = run_trial(MemoryElement(shipped), *commands)
    assert run_trial(same, *commands) == expected != run_trial(other, *commands)
    assert run_trial(MemoryElement(shipped), Read(), *commands) != expected
