# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies keep each result at once, go on where they were stopped, and run on many processes."""

import json
import os

import pytest

from mlmem_lab import results
from mlmem_lab import study as studies
from mlmem_lab.study import STUDY_PLACES, RowFile, Study, load_study
from mlmem_tools.cli.main import main


@pytest.fixture
def lengths(tmp_path, monkeypatch):
    """A study of the lengths of names, whose result file is in a folder of its own."""
    monkeypatch.setattr(results, 'RESULT_FOLDER', tmp_path)
    monkeypatch.setattr(results, 'hash_modules', lambda modules: ' '.join(modules))
    found = Study('lengths', len, ('case_2', 'bits_1', 'byte'), ('lab/lengths.py',), seed=3)
    monkeypatch.setitem(STUDY_PLACES, 'times', 'lengths')
    monkeypatch.setattr(studies, 'load_study', lambda name: found)
    return found


def run_study(*arguments):
    return main(['study', 'times', *arguments, '--jobs', '1'])


def test_a_study_of_some_cases_keeps_the_others(lengths):
    assert run_study('bits_1', 'byte') == run_study('byte') == 0
    found = results.load_result(lengths.path)
    assert found['presets'] == {'bits_1': 6, 'byte': 4}
    modules = [*results.DEVICE_MODULES, 'lab/lengths.py']
    assert found['hashes'] == dict.fromkeys(['bits_1', 'byte'], ' '.join(modules))
    assert found['command'] == 'mlmem study lengths bits_1 byte'
    assert found['seed'] == 3


def test_a_study_without_cases_measures_what_is_missing_or_stale(lengths, monkeypatch):
    run_study('bits_1', 'byte')
    assert lengths.list_missing() == ['case_2']
    assert run_study() == 0
    assert lengths.list_missing() == []
    monkeypatch.setattr(results, 'hash_modules', lambda modules: 'changed')
    assert lengths.list_missing() == list(lengths.cases)


def test_an_unknown_case_is_refused(lengths, capsys):
    assert run_study('bits_9') == 2
    assert 'got bits_9' in capsys.readouterr().err
    assert not lengths.path.exists()


@pytest.mark.parametrize('name', STUDY_PLACES)
def test_every_study_is_that_of_its_result_file(name):
    """The committed file has its cases, and names modules that are there."""
    found = load_study(name)
    assert found.name == name
    kept = results.load_result(found.path)
    assert set(kept['hashes']) <= set(found.cases)
    assert all((results.CHECKOUT_ROOT / module).exists() for module in found.modules)


def square(x):
    return {'x': x, 'process': os.getpid()}


def test_rows_go_on_where_they_were_stopped(tmp_path):
    """A torn last line, as a kill leaves it, is computed again."""
    path, tasks = tmp_path / 'rows.jsonl', {f'{x}': (x,) for x in range(5)}
    with RowFile(path, {'a': 1}) as file:
        done = file.compute(square, tasks, None)
        assert [next(done), next(done)] == ['0', '1']
    path.write_text(path.read_text() + '["2", {"x"')
    with RowFile(path, {'a': 1}) as file:
        assert list(file.rows) == ['0', '1']
        assert list(file.compute(square, tasks, None)) == ['2', '3', '4']
    assert [json.loads(line)[0] for line in path.read_text().splitlines()[1:]] == list(tasks)


def test_rows_of_another_study_are_refused(tmp_path):
    with RowFile(tmp_path / 'rows.jsonl', {'a': 1}):
        pass
    with pytest.raises(ValueError, match='another study'):
        RowFile(tmp_path / 'rows.jsonl', {'a': 2})
