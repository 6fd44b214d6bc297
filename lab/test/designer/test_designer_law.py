# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Can these cells be a memory? Of the paper's, measured shells, and phi-4."""

import dataclasses
import math
from pathlib import Path

import pytest

from mlmem import law_file, load_element
from mlmem.physics import CASE_II
from mlmem.physics.curve import Curve
from mlmem_lab.designer import DesignNotFound, proposal, propose_design
from mlmem_lab.designer.proposal import GRADIENT_PER_CELL, balance_gradient
from mlmem_tools.checks import Report
from mlmem_tools.cli.main import main
from mlmem_tools.law.curves import average_runs, load_run

EXAMPLES = Path(__file__).parents[3] / 'examples/law'


def cell(law, **changed):
    return dataclasses.replace(CASE_II, **{'law': law, 'd': 1.0, 'phase': 0, **changed})


def paper():
    """From above the ground state before the two that are used to below the one after them."""
    low, high = (CASE_II.potential.barrier(n) for n in (0, 2))
    return Curve.of(CASE_II.potential.slope, low, high, 256)


def phi_4(tilt):
    """psi = h (1 - D^2)^2 - h tilt D, with the stiffness of the paper's blank cells."""
    h = CASE_II.k_s1 / 8.0
    return Curve.of(lambda D: h * (4.0 * D * (D * D - 1.0) - tilt), -1.6, 1.6, 257)


def test_a_gradient_balances_what_a_passage_sets_free():
    """phi-4: 2 h tilt is set free, and a wall has (2/3) sqrt(2 h) on site, half of its energy."""
    h, tilt = CASE_II.k_s1 / 8.0, 1e-3
    expected = 2.0 * h * tilt / (2.0 / 3.0 * math.sqrt(2.0 * h))
    assert balance_gradient(cell(phi_4(tilt))) == pytest.approx(expected, rel=0.02)  # 1 / width^2
    assert abs(balance_gradient(cell(phi_4(0.0)))) < 1e-9


def test_what_is_no_memory():
    with pytest.raises(DesignNotFound, match='no carrier tells them'):
        propose_design(4, cell(phi_4(0.0)))


def test_the_papers_law_as_a_curve_gives_the_papers_design(tmp_path, capsys, monkeypatch):
    """By the command: 5 mm a cell and 2 N/mm a spring, two levels, and a file that loads. To the
    error of the curve, which has a ground state fewer on either side.
    """
    length, spring, mass = 5e-3, 2e3, 0.02
    curve, mine = paper(), tmp_path / 'mine.yaml'
    force = [each * spring * length for each in curve.force]
    law = Curve(curve.low * length, curve.high * length, tuple(force))
    law_file.write_law_file(tmp_path / 'law.yaml', law)
    given = ['--length', str(length), '--spring', str(spring), '--mass', str(mass)]
    asked = ['design', '--law', str(tmp_path / 'law.yaml'), *given, '--levels', '2']
    assert main([*asked, '--output', str(mine)]) == 0
    assert '2 levels, with a gradient of -3' in capsys.readouterr().out
    design, settings = load_element(str(mine)).design_and_settings
    assert settings.scale.time == pytest.approx(math.sqrt(mass / spring))
    with monkeypatch.context() as patch:
        patch.setattr(proposal, 'check', lambda *_: Report(()))  # in studies/test_proof.py
        plain = propose_design(2)
    assert dataclasses.replace(settings, scale=plain.settings.scale) == plain.settings
    known = dataclasses.replace(design, law=None, d=CASE_II.d, phase=1, gamma=GRADIENT_PER_CELL)
    assert known == plain.design
    assert design.gamma == pytest.approx(GRADIENT_PER_CELL, rel=1e-3)
    shells = average_runs([load_run(EXAMPLES / f'shell_run{k}.csv') for k in (1, 2)], 64)
    law_file.write_law_file(tmp_path / 'shells.yaml', shells.curve)
    assert main(['design', '--law', str(tmp_path / 'shells.yaml'), *given]) == 2
    assert 'A gradient of as much a cell balances that' in capsys.readouterr().err
    assert main(['design', '--law', str(tmp_path / 'law.yaml')]) == 2
    assert 'need each other' in capsys.readouterr().err
    assert main(['design', '--law', str(tmp_path / 'none.yaml'), *given]) == 2
    assert 'none.yaml' in capsys.readouterr().err
