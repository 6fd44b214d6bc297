# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem figures` as a user meets it: in this process, and all of it in one of its own."""

import json

import pytest

from mlmem_lab.paper.gallery import FIGURES_BY_NAME
from mlmem_tools.cli.main import main

ENDINGS = ('npz', 'png', 'svg')


def test_two_figures_side_by_side_and_their_claims_are_told(tmp_path, capsys):
    options = ['--draft', '--jobs', '2', '--output', str(tmp_path), '--json']
    assert main(['figures', '1c', '3a', *options]) == 0
    told = json.loads(capsys.readouterr().out)
    verdicts = {claim['paper'].partition(' (p.')[0]: claim['verdict'] for claim in told['claims']}
    (bands,) = FIGURES_BY_NAME['3a'].claims
    assert verdicts[bands.sentence] == 'in part'  # the bands overlap
    alone = [claim for claim in FIGURES_BY_NAME['1c'].claims if claim.needs == ('1c',)]
    assert set(verdicts) == {bands.sentence, *(claim.sentence for claim in alone)}
    files = {file.name for file in (tmp_path / 'figures').iterdir()}
    assert files == {f'{stem}.{end}' for stem in ('fig_1c', 'fig_3a') for end in ENDINGS}


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
