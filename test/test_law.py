# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From force curves to a law: a phi-4 element whose wells, barrier and bands are known.

psi = h (1 - (x / w)^2)^2 has its wells at +-w, a stiffness of 8 h / w^2 there, a barrier h, and
the peak force 8 h / (3 sqrt(3) w).
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from mlmem.law_file import read_law_file, write_law_file
from mlmem.parsing import DecodeError
from mlmem.physics import Design
from mlmem_tools.cli.main import main
from mlmem_tools.law.curves import average_runs, load_run

EXAMPLES = Path(__file__).parents[1] / 'examples/law'
H, W, TILT = 0.02, 0.015, 0.1
"""Barrier in J, half the way in m, a force in N."""


def write(path, *, rub=0.0, tilt=0.0, scale=1.0, back=False, mm=True):
    """Write a test of the element, from below its first well to above its second."""
    x = np.linspace(-1.3 * W, 1.3 * W, 2_001)
    force = 4.0 * H / W * (x / W) * ((x / W) ** 2 - 1.0) * scale + tilt
    rows = [(D, f + rub) for D, f in zip(x, force, strict=True)]
    rows += [(D, f - rub) for D, f in zip(x[::-1], force[::-1], strict=True)][1:] if back else []
    head, length, unit = ('displacement_mm,force_mN', 1e3, 1e3) if mm else (
        'displacement_m,force_N', 1.0, 1.0
    )  # fmt: skip
    lines = [f'{length * D:.15g},{unit * f:.15g},0' for D, f in rows]
    path.write_text('\n'.join(['# a test', f'{head},work_J', *lines]))
    return load_run(path)


def test_law_finds_wells_and_barrier(tmp_path):
    """Means over intervals of a 1/63rd of the way round off a peak by their curvature."""
    for mm in (True, False):
        found = average_runs([write(tmp_path / 'one.csv', mm=mm)], 128)
        first, second = found.wells
        assert (first['displacement'], second['displacement']) == pytest.approx((-W, W), rel=1e-3)
        assert first['stiffness'] == pytest.approx(8.0 * H / W**2, rel=2e-3)
        (step,) = found.barriers
        assert step['barrier'] == pytest.approx(H, rel=2e-3)
        assert step['force'] == pytest.approx(8.0 * H / (3.0 * math.sqrt(3.0) * W), rel=2e-3)
        assert abs(step['set_free']) < 1e-3 * H
        assert step['force_std'] is None


def test_law_averages_both_ways_and_reports_the_loss(tmp_path):
    """A dry friction of 0.05 N over 2.6 w, out and back."""
    found = average_runs([write(tmp_path / 'one.csv', rub=0.05, back=True)], 64)
    assert found.runs[0].lost == pytest.approx(2.0 * 0.05 * 2.6 * W, rel=1e-3)
    assert found.barriers[0]['barrier'] == pytest.approx(H, rel=5e-3)


def test_law_of_several_runs_has_mean_and_scatter(tmp_path):
    """Forces of 0.9, 1 and 1.1: a standard deviation of 0.1. A tilt sets 2 w times it free."""
    runs = [write(tmp_path / f'{k}.csv', scale=k) for k in (0.9, 1.0, 1.1)]
    (step,) = average_runs(runs, 64).barriers
    assert step['barrier'] == pytest.approx(H, rel=5e-3)
    assert step['barrier_std'] == pytest.approx(0.1 * H, rel=5e-3)
    unequal = [write(tmp_path / f'{tilt}.csv', tilt=tilt) for tilt in (-TILT, 0.0, TILT)]
    (step,) = average_runs(unequal, 64).barriers
    assert step['depth_std'] == pytest.approx(2.0 * W * TILT / step['barrier'], rel=0.02)
    tilted = average_runs([write(tmp_path / 'tilted.csv', tilt=-TILT)], 64).barriers[0]
    assert tilted['set_free'] == pytest.approx(2.0 * W * TILT, rel=0.01)


def test_law_continues_a_curve_to_its_first_well():
    """The real shells begin at 0.08 mm and 0.06 N; the second well is near the authors' 39 mm."""
    found = average_runs([load_run(EXAMPLES / f'shell_run{k}.csv') for k in (1, 2)], 64)
    first, second = found.wells
    assert -0.5e-3 < first['displacement'] < 0.0
    assert second['displacement'] == pytest.approx(39.0e-3, rel=0.03)
    assert found.barriers[0]['barrier'] == pytest.approx(8.4e-3, rel=0.02)
    assert 6.0e-3 < found.barriers[0]['set_free'] < 8.5e-3


def test_law_file_makes_a_design(tmp_path):
    found = average_runs([write(tmp_path / 'one.csv')], 64)
    write_law_file(tmp_path / 'law.yaml', found.curve, found.std)
    curve = read_law_file(tmp_path / 'law.yaml', length=W, stiffness=8.0 * H / W**2)
    design = Design(N=60, gamma=0.0, beta=-0.1, J=20, J_s=40, j_0=17.0, d=0.1, law=curve, phase=0)
    assert (design.D_s1, design.D_s2) == pytest.approx((-1.0, 1.0), rel=5e-3)
    assert design.k_s1 == pytest.approx(0.1, rel=0.01)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('', 'a header that names one of displacement_um'),
        ('displacement,force_N\n', 'line 1: it must be a header that names one of'),
        ('displacement_mm,force_N\n1,2\n1\n', 'line 3: it must be 2 values; got 1'),
        ('# x\ndisplacement_mm,force_N\n1,nan\n', 'line 3: force_N must be a finite number'),
        ('displacement_mm,force_N\nx,1\n', 'line 2: displacement_mm must be a finite number'),
        ('displacement_mm,force_N\n1,1\n', 'at least 16 rows; got 1'),
    ],
)
def test_file_that_is_no_curve_is_rejected(tmp_path, text, message):
    (tmp_path / 'bad.csv').write_text(text)
    with pytest.raises(DecodeError, match=message):
        load_run(tmp_path / 'bad.csv')


def test_law_command_writes_a_file(tmp_path, capsys):
    shells = [str(EXAMPLES / f'shell_run{k}.csv') for k in (1, 2)]
    output = tmp_path / 'law.yaml'
    assert main(['law', *shells, '--output', str(output), '--json']) == 0
    assert len(json.loads(capsys.readouterr().out)['wells']) == 2
    assert len(read_law_file(output).ground_states) == 2
    assert main(['law', *shells]) == 0
    assert '+-' in capsys.readouterr().out


def test_law_command_without_two_wells_writes_nothing(tmp_path, capsys):
    straight, output = tmp_path / 'straight.csv', tmp_path / 'none.yaml'
    rows = '\n'.join(f'{k},{k - 9}' for k in range(30))
    straight.write_text(f'displacement_mm,force_N\n{rows}')
    assert main(['law', str(straight), '--output', str(output)]) == 1
    said = capsys.readouterr()
    assert 'needs two wells; the mean has 1 well: not written' in said.err
    assert 'straight.csv: 1 well\n' in said.out
    assert not output.exists()
    assert main(['law', str(tmp_path / 'none.csv')]) == 2
    assert 'none.csv' in capsys.readouterr().err
