# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A fitted element in place of the ideal one: what judges designs judges it, in one way."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from small_register import first_levels

from mlmem import element_file, load_element
from mlmem.element_file import Element
from mlmem.physics import Scatter, draw_specimen
from mlmem.readers.calibration import PulseCorrection, PulseCorrections, hash_schedule
from mlmem_lab.studies.proof import Proof
from mlmem_tools.cli.main import main
from mlmem_tools.identification.plan import plan_pulses

CHOSEN = load_element('bits_1')


@pytest.fixture(scope='module')
def element():
    made = draw_specimen(CHOSEN.design, Scatter(alpha=0.01), 3)
    trims = plan_pulses(made, CHOSEN).corrections
    deviations = np.full(CHOSEN.design.N, 1e-4)
    return Element(made, deviations, 1.001, plan=trims, settings=CHOSEN.settings)


@pytest.fixture(scope='module')
def file(tmp_path_factory, element):
    path = tmp_path_factory.mktemp('element') / 'element.yaml'
    element_file.write_element_file(path, element)
    return path


@pytest.mark.parametrize('judge', ['check', 'prove'])
def test_element_is_judged_in_place_of_the_ideal_one(judge, file, element, capsys):
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


def test_proof_reads_and_kicks_a_register_as_known():
    chosen = first_levels(3)
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
