# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies keep each result at once, and go on where they were stopped."""

import importlib
import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from mlmem_lab import results
from mlmem_lab import study as studies
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


def test_study_of_some_cases_keeps_the_others(lengths):
    assert run_study('bits_1', 'byte') == run_study('byte') == 0
    found = results.load_result(lengths.path)
    assert found['cases'] == {'bits_1': 6, 'byte': 4}
    modules = [*results.DEVICE_MODULES, 'lab/lengths.py']
    assert found['hashes'] == dict.fromkeys(['bits_1', 'byte'], ' '.join(modules))
    assert found['command'] == 'mlmem study lengths bits_1 byte'
    assert found['seed'] == 3


def test_study_without_cases_measures_what_is_missing_or_stale(lengths, monkeypatch):
    run_study('bits_1', 'byte')
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
