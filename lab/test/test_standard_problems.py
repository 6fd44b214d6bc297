# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standard problems: answers converge, two integrators agree, and a file gets its verdict."""

import csv
from types import SimpleNamespace

import pytest
from sampled import sampled

from mlmem.physics import NOH_BATHE
from mlmem_lab.standard_problems import ALL_PROBLEMS
from mlmem_lab.standard_problems.command import standard_problems
from mlmem_lab.standard_problems.verdict import ANSWERS_FILE, read

ANSWERS = {(each.problem, each.quantity): each for each in read(ANSWERS_FILE)}


LONG = 'kink', 'speed law'
"""Most of the time."""


@pytest.mark.parametrize(
    'problem',
    sampled(ALL_PROBLEMS, lambda each: each.name not in LONG),
    ids=lambda each: each.name,
)
def test_the_committed_answers_are_what_another_method_finds(problem):
    """Noh-Bathe at twice the step, where its error is still below 0.1 %."""
    found = problem.solve(NOH_BATHE, 2.0 * problem.step)
    assert {name for kind, name in ANSWERS if kind == problem.name} == set(found)
    wrong = {name: v for name, v in found.items() if not ANSWERS[problem.name, name].right(v)}
    assert wrong == {}


def judged(path, rows):
    with path.open('w', newline='') as file:
        csv.writer(file).writerows([['problem', 'quantity', 'value'], *rows])
    return standard_problems.run(SimpleNamespace(file=path, solve=None, json=False))


def test_a_file_gets_its_verdict(tmp_path, capsys):
    right = ANSWERS['kink', 'speed'].value
    assert judged(tmp_path / 'a.csv', [['kink', 'speed', right * 1.0005]]) == 0
    assert '1 of 1 right' in capsys.readouterr().out
    assert judged(tmp_path / 'b.csv', [['kink', 'speed', right * 1.01]]) == 1
    assert '0 of 1 right' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('rows', 'words'),
    [
        ([['kink', 'sped', 1.0]], 'there is no kink: sped'),
        ([['kink', 'speed', 'nan']], 'line 2: value must be a number; got nan'),
    ],
)
def test_a_file_that_cannot_be_used(tmp_path, capsys, rows, words):
    assert judged(tmp_path / 'a.csv', rows) == 2
    assert words in capsys.readouterr().err
    (tmp_path / 'b.csv').write_text('a,b\n1,2\n')
    other = SimpleNamespace(file=tmp_path / 'b.csv', solve=None, json=False)
    assert standard_problems.run(other) == 2
    assert 'must have the columns problem, quantity, value' in capsys.readouterr().err
