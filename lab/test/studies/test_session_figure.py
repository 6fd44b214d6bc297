# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a session: what it shows, and what it says is missing."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem import End
from mlmem.instrument.echo import detection_threshold
from mlmem_lab.studies.session_figure import build_figure, find_last_echoes, read_motion
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.contract.topics import OK, Status
from mlmem_ros.session.data import load_session

DATA = Path(__file__).parents[3] / 'test' / 'data'


def test_picture_of_one_write_shows_its_verifying_echo():
    reader = BagReader(DATA / 'life')
    session = load_session(reader)
    del session.events['outcome'][1:]
    (((t, _, v_c), written),) = find_last_echoes(session, End.LEFT)
    probe = session.header.settings.probe
    heard = (v_c > detection_threshold(probe, t)) & (t > 100.0)
    assert t[np.argmax(heard)] == pytest.approx(float(written['delay']))
    assert find_last_echoes(session, End.RIGHT) == []
    drawn = build_figure(session, *read_motion(reader, session)).get_axes()
    assert r'$\Delta_j$' in [axes.get_title() for axes in drawn]
    (echo,) = (axes for axes in drawn if '(b)' in axes.get_title(loc='left'))
    assert len(t) in [len(line.get_xdata()) for line in echo.lines]
    (delays,) = (axes for axes in drawn if '(c)' in axes.get_title(loc='left'))
    assert delays.lines[1].get_xydata().tolist() == [[2.0, float(written['delay'])]]


@pytest.mark.parametrize('values', [{}, {'level': 'x', 'delay': '1'}, {'level': '2', 'delay': ''}])
def test_outcome_without_a_level_has_no_echo(values):
    session = load_session(DATA / 'life')
    session.events['echo'] = [(0.5, np.zeros(6, np.float32))]
    outcome = {'procedure': 'read', 'end': 'left', **values}
    session.events['outcome'] = [(1.0, Status(OK, '', outcome))]
    assert find_last_echoes(session, End.LEFT) == []
    outcome.update(level='2', delay='1.5')
    assert len(find_last_echoes(session, End.LEFT)) == 1


def test_configuration_of_another_element_is_rejected():
    reader = BagReader(DATA / 'life')
    session = load_session(reader)
    header = dataclasses.replace(session.header.design, N=224)
    session.header = SimpleNamespace(design=header)
    with pytest.raises(BagError, match=r'/mlmem/field at .* data must have 224 cells; got 225'):
        read_motion(reader, session)
