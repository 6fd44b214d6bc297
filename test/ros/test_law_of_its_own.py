# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node whose element has an on-site law of its own.

The law is the paper's, measured as it were: that of a preset in steel, 5 mm a cell and 2000 N/m
a spring. So it writes and reads as the preset does.
"""

from dataclasses import replace

import numpy as np
import pytest
from nodes import QUICK
from robot import Robot

from mlmem import element_file, law_file, preset
from mlmem.physics.curve import Curve
from mlmem_ros.host.settings import DESCRIPTION
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.view.about import PAGE_PARAMETERS, About
from mlmem_tools.view.session_frame import load_frame as load_page

PRESET = preset(QUICK['element'])
PAPER = PRESET.design
LENGTH, STIFFNESS = 5e-3, 2e3


@pytest.fixture(scope='module')
def file(tmp_path_factory):
    """Its ground states are those of the paper numbered 0 to 3; in them, 0 is the first."""
    low, high = (PAPER.potential.ground_state(n) for n in (0, 3))
    cells = Curve.of(PAPER.potential.slope, low - 0.5, high + 0.5, 512)
    force = np.array(cells.force) * STIFFNESS * LENGTH
    law = replace(cells, low=cells.low * LENGTH, high=cells.high * LENGTH, force=tuple(force))
    folder = tmp_path_factory.mktemp('laws')
    law_file.write_law_file(folder / 'law.yaml', law)
    in_cells = law_file.read_law_file(folder / 'law.yaml', LENGTH, STIFFNESS)
    design = replace(PAPER, d=1.0, law=in_cells)
    quick = replace(PRESET.settings.scale, time=QUICK['scale.time'])
    settings = replace(PRESET.settings, scale=replace(quick, length=LENGTH, stiffness=STIFFNESS))
    element_file.write_element_file(
        folder / 'element.yaml', element_file.as_designed(design, settings)
    )
    return folder / 'element.yaml'


def test_element_with_its_own_law_writes_and_replays(start, file, tmp_path):
    """The node publishes the element itself: neither page nor replay needs the file."""
    copy, bag = tmp_path / 'element.yaml', tmp_path / 'session'
    copy.write_text(file.read_text())
    node = start({'element': str(copy), 'record.path': str(bag)})
    copy.unlink()
    with Robot() as robot:
        assert robot.write(3).success
        assert robot.trigger('read')['level'] == 3
        known = node.memory.parameters(*PAGE_PARAMETERS).wait()
        element = element_file.parse(known[DESCRIPTION], DESCRIPTION)
        shown = About.of(element.design, element.settings, '/mlmem', known)
        node.terminate()
        assert node.exit_status() == 0
    report = run_replay(load_session(bag))
    assert report.exact
    assert report.outcomes[-1].reading.level == 3
    assert load_session(bag).design == shown.design
    assert shown.phases == pytest.approx((PAPER.D_s1, PAPER.D_s2), abs=1e-6)
    of_the_paper = About.of(*PRESET, '').json['bands']
    for phase, band in shown.json['bands'].items():
        assert band == pytest.approx(of_the_paper[phase], rel=1e-4)
    assert load_page(bag).parameters['design.law'] == shown.design.as_dict()['law']


@pytest.mark.parametrize(
    ('old', 'new', 'reason'),
    [('force: [', 'force: [x, ', 'design.law.force'),
     ('phase: 1', 'phase: 7', 'no ground state 7'),
     ('d: 1.0', 'd: 1.0\n  a: 0.3', 'with a law leave them out')],
)  # fmt: skip
def test_invalid_law_is_rejected_with_its_line(refused, file, tmp_path, old, new, reason):
    wrong = tmp_path / 'wrong.yaml'
    text = file.read_text()
    assert old in text
    wrong.write_text(text.replace(old, new, 1))
    line = refused({'element': str(wrong)})
    assert reason in line
    assert 'wrong.yaml, line ' in line
