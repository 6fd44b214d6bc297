# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands `mlmem fit` and `mlmem plan`, from CSV files of shots."""

import json

import numpy as np
import pytest
from shot_file import save_shot

from mlmem import element_file, load_element
from mlmem_tools.cli import fit as command
from mlmem_tools.cli.main import main
from mlmem_tools.identification import csv_shots

from .truth import SMALL

FEW = slice(0, 5, 2)
"""Two shots of the blank element, and one with a wall: the fit of all is known."""


@pytest.fixture(scope='module')
def bench(tmp_path_factory, fitted):
    """A folder with a design and some shots of a hidden element, which is returned too."""
    folder, (element, shots, _) = tmp_path_factory.mktemp('bench'), fitted
    design = folder / 'design.yaml'
    element_file.write_element_file(
        design, element_file.as_designed(SMALL, load_element('bits_1').settings)
    )
    for number, shot in enumerate(shots[FEW]):
        save_shot(folder / f'{number}.csv', shot)
    return folder, element


def run(capsys, *arguments):
    """Return the exit status of a command, and what it printed, as JSON if it is."""
    status = main([str(each) for each in arguments])
    told = capsys.readouterr()
    return status, json.loads(told.out) if '--json' in arguments else told.out, told.err


def test_fit_and_plan_commands_make_pulses_of_shots(bench, capsys, fitted, monkeypatch):
    """What is fitted are the shots in the files; their fit, which takes long, is known."""
    (folder, element), (_, measured, found) = bench, fitted

    def known(design, read, **_):
        assert design == SMALL
        for one, other in zip(read, measured[FEW], strict=True):
            assert (one.samples == other.samples).all()
        return found

    monkeypatch.setattr(command, 'fit_element', known)
    file, design = folder / 'element.yaml', folder / 'design.yaml'
    files = sorted(folder.glob('*.csv'))
    status, told, why = run(capsys, 'fit', *files, '--design', design, '--output', file, '--json')
    assert status == 0, why
    assert told['chi2'] == pytest.approx(found.chi2)
    pulls = (np.array(told['alpha']) - element.strength) / told['alpha_std']
    assert np.abs(pulls).max() < 5.0
    assert told['undetermined']
    assert told['held_out'] == pytest.approx(found.held_out)
    assert told['added'] == []
    known = element_file.read_element_file(file)
    assert known.specimen.alpha.tolist() == pytest.approx(told['alpha'])

    status, told, _ = run(capsys, 'plan', file, '--json')
    assert status == 0
    assert [step['level'] for step in told['steps']] == [0, 1]
    assert min(step['margin'] for step in told['steps']) >= 0.03
    assert len(element_file.read_element_file(file).plan.steps) == SMALL.levels


def test_fit_command_that_fails_writes_nothing(bench, capsys, tmp_path):
    folder, _ = bench
    blank = [path for path in folder.glob('*.csv') if not csv_shots.load_shot(path).wall]
    file, design = tmp_path / 'element.yaml', folder / 'design.yaml'
    status, _, complaint = run(capsys, 'fit', *blank, '--design', design, '--output', file)
    assert status == 1
    assert 'shots with a wall are needed' in complaint
    assert not file.exists()
