# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every figure, drawn from small data, and `mlmem figures` as a user meets it."""

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mlmem_lab.paper.figure import load_data
from mlmem_lab.paper.gallery import FIGURES_BY_NAME
from mlmem_lab.studies import style
from mlmem_tools.cli.main import main

STILL = [figure.name for figure in FIGURES_BY_NAME.values() if figure.ending == 'png']


@pytest.mark.parametrize('name', STILL)
def test_every_figure_has_data_in_each_panel(name, small):
    with style.style_context():
        figure = FIGURES_BY_NAME[name].draw(small[name])
    assert figure.get_figwidth() == 7.2
    assert all(axes.has_data() or axes.texts for axes in figure.axes)


def test_figures_command_writes_figures_and_verdicts(small, tmp_path, capsys):
    """A picture, a vector file and the data of each; saved again, they have the same bytes."""
    options = ['--draft', '--jobs', '1', '--output', str(tmp_path), '--json']
    assert main(['figures', '1c', '3a', *options]) == 0
    told = json.loads(capsys.readouterr().out)
    verdicts = {claim['paper'].partition(' (p.')[0]: claim['verdict'] for claim in told['claims']}
    (bands,) = FIGURES_BY_NAME['3a'].claims
    assert verdicts[bands.sentence] == 'in part'  # the bands overlap
    alone = [claim for claim in FIGURES_BY_NAME['1c'].claims if claim.needs == ('1c',)]
    assert set(verdicts) == {bands.sentence, *(claim.sentence for claim in alone)}
    folder = tmp_path / 'figures'
    assert {file.name for file in folder.iterdir()} == {
        f'{stem}.{end}' for stem in ('fig_1c', 'fig_3a') for end in ('npz', 'png', 'svg')
    }
    data = small['3a']
    _, *pictures = FIGURES_BY_NAME['3a'].save(data, tmp_path)
    for file in pictures:
        assert file.read_bytes() == (folder / file.name).read_bytes()
    assert Image.open(folder / 'fig_3a.png').size[0] == 120 * 7.2
    assert len(list(ElementTree.parse(folder / 'fig_3a.svg').getroot().iter())) > 100
    kept = load_data(folder / 'fig_3a.npz')
    assert set(kept) == set(data)
    for key, value in data.items():
        np.testing.assert_array_equal(kept[key], value)


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['9z'], 'figure must be one of 1c, 2a'),
        (['2c', '--jobs', '0'], '--jobs must be at least 1; got 0'),
        (['2c', '--output', 'file/x'], '--output must be a writable folder'),
    ],
)
def test_wrong_figures_command_is_rejected(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'file').write_text('in the way', encoding='utf-8')
    assert main(['figures', *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f'mlmem figures: {message}')
    assert [file.name for file in tmp_path.iterdir()] == ['file']


def test_film_moves_and_shows_what_has_succeeded(small, tmp_path):
    assert small['s1']['success'].all()
    files = {file.suffix: file for file in FIGURES_BY_NAME['s1'].save(small['s1'], tmp_path)}
    with Image.open(files['.gif']) as film:
        assert 1 < film.n_frames <= len(small['s1']['t'])  # equal neighbours are joined
        pictures = []
        for frame in (0, film.n_frames // 2, film.n_frames - 1):
            film.seek(frame)
            pictures.append(np.asarray(film.convert('L')))
    assert np.any(pictures[0] != pictures[1])
    assert np.any(pictures[1] != pictures[2])


def test_every_file_of_the_folder_is_registered():
    folder = Path(__file__).parents[2] / 'mlmem_lab' / 'paper' / 'figures'
    files = {file.stem for file in folder.glob('*.py')} - {'__init__'}
    assert files == {figure.stem for figure in FIGURES_BY_NAME.values()}
