# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node whose element has an on-site law of its own, from a file as `mlmem law` writes it.

The law is the paper's, measured as it were: that of a preset in steel, 5 mm a cell and 2000 N/m
a spring. So it writes and reads as the preset does.
"""

from dataclasses import replace

import numpy as np
import pytest
from nodes import QUICK
from rclpy.parameter import Parameter
from robot import Robot

from mlmem import law_file, preset
from mlmem.physics.curve import Curve
from mlmem_ros.host.settings import declare_parameters
from mlmem_ros.parameter_file import load_preset as load_parameters
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.view.about import PAGE_PARAMETERS, About, group_parameters
from mlmem_tools.view.session_frame import load_frame as load_page

PRESET = preset(QUICK['design.preset'])
PAPER = PRESET.design
LENGTH, STIFFNESS = 5e-3, 2e3


@pytest.fixture(scope='module')
def file(tmp_path_factory):
    """Its ground states are those of the paper numbered 0 to 3; in them, 0 is the first."""
    low, high = (PAPER.potential.ground_state(n) for n in (0, 3))
    cells = Curve.of(PAPER.potential.slope, low - 0.5, high + 0.5, 512)
    force = np.array(cells.force) * STIFFNESS * LENGTH
    law = replace(cells, low=cells.low * LENGTH, high=cells.high * LENGTH, force=tuple(force))
    path = tmp_path_factory.mktemp('laws') / 'law.yaml'
    law_file.write_law_file(path, law)
    return path


def node_of(file, **others):
    return {
        'design.law': str(file), 'design.d': 1.0, 'scale.length': LENGTH,
        'scale.stiffness': STIFFNESS, **others,
    }  # fmt: skip


def test_it_remembers_replays_and_is_shown(start, file, tmp_path):
    """The node tells the law itself: neither page nor replay needs the file."""
    copy, bag = tmp_path / 'law.yaml', tmp_path / 'session'
    copy.write_text(file.read_text())
    node = start(node_of(copy, **{'record.path': str(bag)}))
    copy.unlink()
    with Robot() as robot:
        assert robot.write(3).success
        assert robot.trigger('read')['level'] == 3
        known = node.memory.parameters(*PAGE_PARAMETERS).wait()
        shown = About.of(group_parameters(known), '/mlmem')
        node.terminate()
        assert node.exit_status() == 0
    report = run_replay(load_session(bag))
    assert report.exact
    assert report.outcomes[-1].reading.level == 3
    assert load_session(bag).design == shown.design
    assert shown.phases == pytest.approx((PAPER.D_s1, PAPER.D_s2), abs=1e-6)
    of_the_paper = About.of(paper(), '').json['bands']
    for phase, band in shown.json['bands'].items():
        assert band == pytest.approx(of_the_paper[phase], rel=1e-4)
    assert load_page(bag).parameters['design.law'] == shown.design.as_dict()['law']


def set_all(node, values):
    given = [Parameter(name, value=value) for name, value in values.items()]
    return node.set_parameters_atomically(given)


def paper():
    return {'design': PAPER.as_dict(), **PRESET.settings.as_dict()}


def test_a_page_asks_for_parameters_that_there_are():
    assert set(PAGE_PARAMETERS) <= {name for name, *_ in declare_parameters()}


def test_what_a_node_tells_makes_the_same_element(declared, file, tmp_path):
    """Its text in place of a file; a preset brings the paper's law back; scales are heeded."""
    node, given = declared(node_of(file))
    text = node.get_parameter('design.law').value
    _, again = declared(node_of(text))
    assert again.values().design == given.values().design
    assert again.digest() == given.digest() != declared()[1].digest()
    longer = declared(node_of(file, **{'scale.length': 2 * LENGTH}))[1].values().design
    assert longer.D_s2 - longer.D_s1 == pytest.approx(0.5 * (PAPER.D_s2 - PAPER.D_s1), abs=1e-6)
    assert set_all(node, {'design.preset': 'bits_4'}).successful
    assert given.values().design == preset('bits_4').design
    assert set_all(node, {'design.law': str(file)}).successful
    assert given.values().design.law is not None
    parameters = tmp_path / 'mine.yaml'
    parameters.write_text(
        f'/**: {{ros__parameters: {{design: {{law: {file}, d: 1.0}}, '
        f'scale: {{length: {LENGTH}, stiffness: {STIFFNESS}}}}}}}'
    )
    assert load_parameters(str(parameters)).design == again.values().design
    of_a_file = declared({'design.file': str(parameters)})[1]
    assert of_a_file.values().design == again.values().design


@pytest.mark.parametrize(
    ('given', 'reason'),
    [
        ({'design.law': '/nowhere.yaml'}, 'design.law: /nowhere.yaml: '),
        ({'design.law': '{format: 1}'}, 'it lacks law: the curve of force'),
        ({'design.a': 0.3}, 'with a law leave them out'),
        ({'design.phase': 7}, 'the law has no ground state 7'),
        ({'files.root': '/usr'}, 'must lie below files.root'),
        ({'scale.length': 1e-12}, 'design.law: this law is none in units of 1e-12 m'),
    ],
)
def test_a_law_that_is_none_is_refused(refused, file, given, reason):
    assert reason in refused(node_of(file, **given))


def test_a_law_that_is_none_changes_nothing_of_a_node(declared, file):
    node, given = declared(node_of(file))
    before = given.values().design
    for bad in ('/nowhere.yaml', '{format: 2}', '{'):
        refused = set_all(node, {'design.law': bad})
        assert not refused.successful
        assert refused.reason.startswith('design.law: ')
    assert given.values().design == before
