# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's figures and claims, from small simulations now, and at full size if slow.

=======================  =============================================================
the result says          must agree with
=======================  =============================================================
verdict of every claim   the judge's, on small data computed here
                         the judge's, on full data (slow)
a judge that approves    the same judge on doctored data: it must not approve
every figure             is drawn from small data, and by `mlmem figures`
=======================  =============================================================
"""

import json
import xml.etree.ElementTree as ElementTree
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from suite import sampled

from mlmem.readers import register
from mlmem_lab.paper.figure import Judgement, Quality, load_data
from mlmem_lab.paper.figures import printed
from mlmem_lab.paper.gallery import FIGURES_BY_NAME, list_claims
from mlmem_lab.results import RESULT_FOLDER, load_result
from mlmem_lab.studies import style
from mlmem_tools.cli.main import main

STILL = [figure.name for figure in FIGURES_BY_NAME.values() if figure.ending == 'png']


@cache
def compute_data(name, quality):
    """Return the data of a figure; they are computed once."""
    with pytest.MonkeyPatch.context() as patch:
        # they take long, and no claim depends on them
        patch.setattr(register, 'find_off_level_states', lambda *_: ())
        if name == 'printed':  # which is made of the data of others
            for other in ('2a', '2b', 'launches'):
                module = getattr(printed, f'fig_{other}', printed.launches)
                data = compute_data(other, quality)
                patch.setattr(module, 'compute_data', lambda _, data=data: data)
        return FIGURES_BY_NAME[name].compute(quality)


BY_KEY = {claim.key: claim for claim in list_claims()}


@pytest.fixture(scope='module')
def committed():
    claims = load_result(RESULT_FOLDER / 'paper.json')['claims']
    return {key: claim['verdict'] for key, claim in claims.items()}


@pytest.mark.parametrize('key', BY_KEY)
@pytest.mark.parametrize('quality', sampled(Quality, lambda quality: quality is Quality.DRAFT))
def test_simulation_gives_the_committed_verdict(key, quality, committed):
    needed = {name: compute_data(name, quality) for name in BY_KEY[key].needs}
    found = BY_KEY[key].judge_data(needed)
    assert found.judgement.value == committed[key], found.numbers


# --- judges that can say no -------------------------------------------------------------------

WRONG = {
    'ground_states': {'ground_energies': lambda x: x + np.array([0.0, 1e-3])},
    'stiffnesses': {'stiffnesses_per_d': lambda x: [x[0], x[0]]},
    'permanent_profile': {'profile_kink': lambda x: x + 0.1},
    'constant_speed': {'speed_anti_kink': lambda x: x * np.linspace(0.5, 1.5, len(x))},
    'both_kinds': {'path_kink': lambda x: x[::-1]},
    'pinned_by_the_defect': {'path_defect': lambda x: x + 5.0},
    'displacement_fits': {'fits': lambda x: np.asarray(x) * 10.0},
    'strain_reproduced': {'v_0': lambda x: 0.8 * x},
    'ansatz_against_held': {'ansatz': lambda x: x + 0.01 * np.sin(np.arange(x.shape[1]))},
    'dip': {'held': lambda x: np.zeros_like(x)},
    'shallowing': {'held': lambda x: x[[5, 4, 3, 2, 1, 0, 10, 9, 8, 7, 6]]},
    'extrema_at_s_min': {'held': lambda x: -x},
    'extrema_at_s_max': {'wall': lambda x: x + 10.0},
    'row_i': {'path_compression_0': lambda x: -x},
    'row_ii': {'static_compression_1': lambda x: 0.5 * x},
    'row_iii': {'path_tension_2': lambda x: x - 19.0},
    'one_threshold': {'plain_left': lambda x: np.full_like(x, np.nan)},
    'echo_from_wall': {'delay_without_wall': lambda x: np.array(100.0)},
    'delay_grows': {'delay_ours_1': lambda x: np.array(0.0)},
    'delays_by_level': {'delay_paper': lambda x: np.full_like(x, x[0])},
    'either_boundary': {'delay_right': lambda x: x[::-1]},
    'eight_levels': {'moved': lambda x: np.ones_like(x)},
    'level_by_level': {'read': lambda x: x - 1},
    'one_step_per_cycle': {'moved': lambda x: 2 * x},
    'unidirectional': {'shift': lambda x: -x},
    'four_events': {'wall': lambda x: x + 1.0},
    'erase': {'left': lambda x: x + 1},
    'moved_launch': {'level': lambda x: np.ones_like(x)},
    'rigid_suffices': {'difference': lambda x: x + 1.0},
    'how_rigid': {'moved': lambda x: np.ones_like(x)},
    'low_frequency': {'echo': lambda x: x + 0.1},
}
"""For every claim that holds, a way to doctor its data that must be noticed."""


def test_every_claim_that_holds_is_tried_with_doctored_data(committed):
    assert set(WRONG) == {
        key for key, value in committed.items() if value in ('holds', 'with other numbers')
    }


@pytest.mark.parametrize('key', WRONG)
def test_doctored_data_do_not_pass(key):
    claim, changes = BY_KEY[key], WRONG[key]
    data = {name: dict(compute_data(name, Quality.DRAFT)) for name in claim.needs}
    for name, change in changes.items():
        data[claim.needs[0]][name] = change(np.asarray(data[claim.needs[0]][name]))
    assert claim.judge_data(data).judgement is not Judgement.HOLDS


# --- figures -----------------------------------------------------------------------------------


@pytest.mark.parametrize('name', STILL)
def test_every_figure_has_data_in_each_panel(name):
    with style.style_context():
        figure = FIGURES_BY_NAME[name].draw(compute_data(name, Quality.DRAFT))
    assert figure.get_figwidth() == 7.2
    assert all(axes.has_data() or axes.texts for axes in figure.axes)


def test_figures_command_writes_figures_and_verdicts(committed, tmp_path, capsys):
    """A picture, a vector file and the data of each; saved again, they have the same bytes."""
    names = ('3a', 'gradient')  # whose claims need no others; the latter is not drawn
    options = ['--draft', '--jobs', '1', '--output', str(tmp_path), '--json']
    assert main(['figures', *names, *options]) == 0
    told = json.loads(capsys.readouterr().out)
    verdicts = {claim['paper'].partition(' (p.')[0]: claim['verdict'] for claim in told['claims']}
    claims = [claim for name in names for claim in FIGURES_BY_NAME[name].claims]
    assert verdicts == {claim.sentence: committed[claim.key] for claim in claims}
    folder = tmp_path / 'figures'
    assert {file.name for file in folder.iterdir()} == {
        'gradient.npz',
        *(f'fig_3a.{end}' for end in ('npz', 'png', 'svg')),
    }
    data = compute_data('3a', Quality.DRAFT)
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


def test_film_moves_and_shows_what_has_succeeded(tmp_path):
    data = compute_data('s1', Quality.DRAFT)
    assert data['success'].all()
    files = {file.suffix: file for file in FIGURES_BY_NAME['s1'].save(data, tmp_path)}
    with Image.open(files['.gif']) as film:
        assert 1 < film.n_frames <= len(data['t'])  # equal neighbours are joined
        pictures = []
        for frame in (0, film.n_frames // 2, film.n_frames - 1):
            film.seek(frame)
            pictures.append(np.asarray(film.convert('L')))
    assert np.any(pictures[0] != pictures[1])
    assert np.any(pictures[1] != pictures[2])


def test_every_file_of_the_folder_is_registered():
    folder = Path(__file__).parents[1] / 'mlmem_lab' / 'paper' / 'figures'
    files = {file.stem for file in folder.glob('*.py')} - {'__init__'}
    assert files == {figure.stem for figure in FIGURES_BY_NAME.values()}
