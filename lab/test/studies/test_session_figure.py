# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a session: what it shows, and what it says is missing."""

from pathlib import Path

import numpy as np
import pytest

from mlmem_lab.studies.session_figure import build_figure
from mlmem_ros.session.data import load_session

DATA = Path(__file__).parents[3] / 'test' / 'data'


def test_the_picture_of_one_write_shows_its_verifying_echo():
    session = load_session(DATA / 'life')
    del session.events['outcome'][1:]
    (((t, *_), written),) = session.reads('left', ('read', 'write'))
    assert session.reads('left') == []
    titled = [(axes.get_title(loc='left'), axes) for axes in build_figure(session).get_axes()]
    panels = {letter: axes for letter in 'bc' for title, axes in titled if f'({letter})' in title}
    (shown,) = [line for line in panels['b'].lines if len(line.get_xdata()) == len(t)]
    heard = shown.get_ydata() > 0.0  # above the threshold, which is the row's line
    assert t[np.argmax(heard & (t > 100.0))] == pytest.approx(float(written['delay']))
    measured = panels['c'].lines[1]
    assert measured.get_xydata().tolist() == [[2.0, float(written['delay'])]]
    assert 'left end' in panels['b'].get_title(loc='left')
    assert r'$\Delta_j$' in [axes.get_title() for axes in build_figure(session).get_axes()]
