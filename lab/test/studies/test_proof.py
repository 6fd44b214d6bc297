# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proofs by simulation: shipped, found and fitted elements do what their table says."""

import json
import pickle
import re
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from rig import first_levels

from mlmem import element_file, load_element, memory
from mlmem.element_file import Element
from mlmem.physics import Scatter, draw_specimen
from mlmem.readers.calibration import PulseCorrection, PulseCorrections, hash_schedule
from mlmem_lab.studies.proof import Proof, Tally, evaluate_run
from mlmem_lab.windows.astray import count_astray
from mlmem_tools.cli.main import main
from mlmem_tools.identification.plan import plan_pulses


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
        replace(
            table,
            delays=(2.0 * table.delays[0] - table.delays[1], *table.delays[:-1]),
            shapes=(table.shapes[0], *table.shapes[:-1]),
        )
        for table in (known.left, known.right)
    )
    vars(proof)['calibration'] = replace(known, left=left, right=right)
    reads = [run for run in proof.points() if run['kind'] == 'read']
    row = evaluate_run(proof, reads[1])
    assert (row['done'], row['passed'], row['error']) == (0, False, 'the wall is at level 1')


def test_design_that_does_not_work_fails_its_proof():
    """Too little tension leaves the wall at level 1."""
    design, settings = load_element('bits_2').design_and_settings
    weak = replace(settings, write=replace(settings.write, tension=0.012))
    tally = Tally.of(prove(Proof(design, weak, sample=1), 0))
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


# --- a fitted element ---------------------------------------------------------------------------

CHOSEN = load_element('bits_1')


@pytest.fixture(scope='module')
def element():
    made = draw_specimen(CHOSEN.design, Scatter(alpha=0.01), 3)
    trims = plan_pulses(made, CHOSEN).corrections
    deviations = np.full(CHOSEN.design.N, 1e-4)
    return Element(made, deviations, 1.001, plan=trims, settings=CHOSEN.settings)


@pytest.mark.parametrize('judge', ['check', 'prove'])
def test_element_is_judged_in_place_of_the_ideal_one(judge, element, tmp_path, capsys):
    file = tmp_path / 'element.yaml'
    element_file.write_element_file(file, element)
    jobs = ('--jobs', '1') if judge == 'prove' else ()
    status = main(['design', judge, '--json', *jobs, str(file)])
    told = capsys.readouterr()
    assert status == 0, told.err  # its pulses are planned
    if judge == 'check':  # of its cells
        [alpha] = [each for each in json.loads(told.out)['findings'] if each['name'] == 'alpha']
        assert alpha['values']['least'] == pytest.approx(element.specimen.alpha.min())
        assert alpha['values']['least'] < CHOSEN.design.alpha.min()


def test_proof_has_the_element_with_its_delays_and_pulses(element):
    proof = Proof(*CHOSEN.design_and_settings, element=element)
    device = pickle.loads(pickle.dumps(proof)).build_device()
    assert (device.chain.specimen.alpha == element.specimen.alpha).all()
    assert device.calibration.right != Proof(*CHOSEN.design_and_settings).calibration.right
    assert device.calibration.corrections_by_level(CHOSEN.settings) == list(element.plan.steps)
    stronger = replace(CHOSEN.settings.write, tension=1.1 * CHOSEN.settings.write.tension)
    other = replace(proof, given=replace(CHOSEN.settings, write=stronger))
    pulses = other.build_device().calibration.corrections_by_level(other.settings)
    assert pulses == list(element.plan.steps)  # factors on whatever is set


def test_proof_reads_and_kicks_a_register_as_known(monkeypatch):
    """Nothing is read here, so the forecasts, which take long, are left out."""
    monkeypatch.setattr(memory, 'choose_reader', lambda *_, **__: Mock(content_count=8))
    chosen = first_levels('byte', 3)
    made = draw_specimen(chosen.design, Scatter(alpha=0.003), 1)
    factors = tuple(1.0 + 0.01 * level for level in range(3))
    plan = PulseCorrections(
        tuple(PulseCorrection(speed=each) for each in factors), hash_schedule(chosen.settings),
        kinks=factors[::-1],
    )  # fmt: skip
    known = Element(made, np.zeros(made.design.N), 1.001, plan=plan)
    device = Proof(*chosen.design_and_settings, element=known).build_device()
    assert device.twin is device.made
    for found, shipped, each in (
        (device.settings.kick.wall_speeds, chosen.settings.kick.wall_speeds, factors),
        (device.settings.kick.kink_speeds, chosen.settings.kick.kink_speeds, factors[::-1]),
    ):
        assert found == pytest.approx(np.multiply(shipped, each), rel=1e-5)
