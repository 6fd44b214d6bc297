# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every figure, drawn from small data: a picture with ink on it, a vector file, its data."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mlmem_lab.paper.figure import load_data
from mlmem_lab.paper.gallery import FIGURES_BY_NAME
from mlmem_lab.studies import style

STILL = [figure.name for figure in FIGURES_BY_NAME.values() if figure.ending == 'png']


@pytest.mark.parametrize('name', STILL)
def test_every_figure_has_data_in_each_panel(name, small):
    with style.style_context():
        figure = FIGURES_BY_NAME[name].draw(small[name])
    assert figure.get_figwidth() == 7.2
    assert all(axes.has_data() or axes.texts for axes in figure.axes)


def test_figure_is_written_as_png_svg_and_data_with_equal_bytes(small, tmp_path):
    figure, data = FIGURES_BY_NAME['3a'], small['3a']
    for folder in ('a', 'b'):
        (tmp_path / folder).mkdir()
        files = {file.suffix: file for file in figure.save(data, tmp_path / folder)}
    assert set(files) == {'.npz', '.png', '.svg'}
    assert {file.stem for file in files.values()} == {figure.stem}
    assert Image.open(files['.png']).size[0] == 120 * 7.2
    assert len(list(ElementTree.parse(files['.svg']).getroot().iter())) > 100
    kept = load_data(files['.npz'])
    assert set(kept) == set(data)
    for key, value in data.items():
        np.testing.assert_array_equal(kept[key], value)
    for ending in ('png', 'svg'):
        one, other = ((tmp_path / f / f'fig_3a.{ending}').read_bytes() for f in 'ab')
        assert one == other


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
    names = {figure.name for figure in FIGURES_BY_NAME.values()}
    assert {'1c', '2a', '2b', '2c', '3a', '3b', '4a', '4b', '5', 's1'} <= names
