# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem figures` as a user meets it, in a process of its own."""

import subprocess
import sys

import pytest

from mlmem_ros.paper.figure import Quality
from mlmem_ros.paper.gallery import select
from mlmem_ros.paper.run import run, run_one


def mlmem(*arguments, folder):
    command = [sys.executable, '-m', 'mlmem_ros.cli.main', 'figures', *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)


def test_one_figure_alone(tmp_path):
    done = mlmem('2c', '--draft', folder=tmp_path)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / 'reproduction' / 'figures'
    assert sorted(file.name for file in folder.iterdir()) == [
        'fig_2c.npz',
        'fig_2c.png',
        'fig_2c.svg',
    ]
    assert '1 of 1 figures' in done.stdout
    assert not (tmp_path / 'reproduction' / 'reproduction.md').exists()


def test_two_figures_on_two_cores_with_their_claims(tmp_path):
    done = mlmem('3a', '1c', '--draft', '--jobs', '2', '--output', 'x/y', folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {file.name for file in (tmp_path / 'x' / 'y' / 'figures').glob('*.png')} == {
        'fig_3a.png',
        'fig_1c.png',
    }
    assert 'in part' in done.stdout  # the bands overlap
    assert 'degenerate' in done.stdout


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['9z'], 'figure must be one of 1c, 2a'),
        (['2c', '--jobs', '0'], '--jobs must be at least 1; got 0'),
        (['2c', '--output', 'file/x'], '--output must be a folder we can write'),
    ],
)
def test_a_wrong_argument_is_refused(arguments, message, tmp_path):
    (tmp_path / 'file').write_text('in the way', encoding='utf-8')
    done = mlmem(*arguments, folder=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert 'Traceback' not in done.stderr
    assert not (tmp_path / 'reproduction').exists()


def test_the_list_names_every_figure(tmp_path):
    done = mlmem('--list', folder=tmp_path)
    assert done.returncode == 0
    assert [line.split()[0] for line in done.stdout.splitlines()] == [
        figure.name for figure in select([])
    ]


def test_processes_run_side_by_side_and_give_what_one_gives(tmp_path):
    figures = select(['2c', '3a'])
    done = list(run(figures, Quality.DRAFT, tmp_path / 'two', 2))
    assert {item.name for item in done} == {'2c', '3a'}
    for figure in figures:
        run_one(figure.name, Quality.DRAFT, tmp_path / 'one')
        one, two = (
            (tmp_path / f / 'figures' / f'{figure.stem}.png').read_bytes() for f in ('one', 'two')
        )
        assert one == two


@pytest.mark.slow
def test_all_of_them_with_the_page(tmp_path):
    done = mlmem('--draft', folder=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / 'reproduction' / 'reproduction.md').read_text(encoding='utf-8')
    assert page.startswith('# The paper, reproduced')
    assert f'{len(select([]))} of {len(select([]))} figures' in done.stdout
