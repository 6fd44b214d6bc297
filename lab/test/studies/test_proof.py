# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proofs by simulation: shipped and found elements do what their table says."""

import dataclasses
import re

import pytest

from mlmem import load_element
from mlmem_lab.studies.proof import Proof, Tally, evaluate_run
from mlmem_lab.windows.astray import count_astray
from mlmem_tools.checks import Verdict, check
from mlmem_tools.cli.main import main


def prove(proof, *numbers):
    """Return the rows of some runs of a proof; of all by default."""
    points = proof.points()
    return [evaluate_run(proof, points[number]) for number in numbers or range(len(points))]


@pytest.mark.parametrize('name', ['bits_2', 'robust_2'])
def test_four_shipped_levels_are_proven(name):
    """Every level up, every downward write, every erase, each at the first attempt."""
    tally = Tally.of(prove(Proof(*load_element(name).design_and_settings)))
    assert tally.errors == ()
    assert tally.upward == (4, 4)
    assert tally.down == (6, 6)  # 1 + 2 + 3
    assert tally.erase == (4, 4)
    assert tally.read == (40, 40)
    assert tally.level_margin > 0.5
    assert tally.erase_time > 0.0
    assert tally.write_time > 0.0


def test_wall_decides_whether_a_read_is_right():
    """Both tables are told the delays of one level further: every read names that one."""
    design, settings = load_element('bits_2').design_and_settings
    proof = Proof(design, settings, sample=1)
    known = proof.calibration
    left, right = (
        dataclasses.replace(
            table,
            delays=(2.0 * table.delays[0] - table.delays[1], *table.delays[:-1]),
            shapes=(table.shapes[0], *table.shapes[:-1]),
        )
        for table in (known.left, known.right)
    )
    vars(proof)['calibration'] = dataclasses.replace(known, left=left, right=right)
    reads = [run for run in proof.points() if run['kind'] == 'read']
    row = evaluate_run(proof, reads[1])
    assert (row['done'], row['passed'], row['error']) == (0, False, 'the wall is at level 1')


def test_design_that_does_not_work_fails_its_proof():
    """Too little tension leaves the wall at level 1, and the kink never reaches it."""
    design, settings = load_element('bits_2').design_and_settings
    weak = dataclasses.replace(
        settings,
        write=dataclasses.replace(settings.write, tension=0.012),
        erase=dataclasses.replace(settings.erase, tension=0.005),
    )
    assert check(design, weak).verdict is Verdict.FAIL
    tally = Tally.of(prove(Proof(design, weak, sample=1)))
    assert tally.upward == (2, 4)
    assert 'upward from -1 to 3: level 2' in tally.errors[0]


# --- by the command line ---------------------------------------------------------------------


@pytest.mark.slow
def test_design_command_finds_writes_and_proves(tmp_path, capsys):
    """Without an output file the element alone is on the standard output."""
    assert main(['design', '--levels', '2', '--trials', '10', '--prove', '--jobs', '1']) == 0
    file, (text, printed) = tmp_path / 'two.yaml', capsys.readouterr()
    file.write_text(text, encoding='utf-8')
    shipped = load_element(str(file))
    assert (shipped.design.levels, shipped.settings.write.method) == (2, 'kick')
    assert count_astray(*shipped, 0.03, elements=10)['astray'] == 0
    assert 'astray at 0.03' in printed
    found = dict(re.findall(r'^([a-z ]+?) +(\d+ of \d+)', printed, re.MULTILINE))
    assert {
        'written and read back': '2 of 2',
        'written downward': '1 of 1',
        'erased': '2 of 2',
        'read in a row': '20 of 20',
    }.items() <= found.items()


def test_design_command_rejects_wrong_arguments(capsys):
    assert main(['design']) == 2
    assert 'give --levels P' in capsys.readouterr().err
    assert main(['design', '--levels', '1000']) == 2
    assert '--levels must be from 2 to 256; got 1000' in capsys.readouterr().err
    assert main(['design', 'prove', 'nothing.yaml']) == 2
    assert 'element must be one of case_1' in capsys.readouterr().err
