# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The committed windows of a register's kicks are those of the code."""

import pytest

from mlmem_lab.results import load
from mlmem_lab.windows.words import FILE, ahead, arrives
from mlmem_ros.device import preset
from mlmem_ros.device.driver import Simulation
from mlmem_ros.physics import Specimen


@pytest.mark.parametrize('number', [2, 9, 12])
def test_a_kick_arrives_inside_its_window_and_not_beyond(number):
    """Beyond an edge, at the far side of its error, at least one case fails."""
    design, settings = preset('byte')
    row = load(FILE)['presets']['byte']['kicks'][number]
    chain = Simulation.of(Specimen(design), settings.time).chain
    cases = ahead(design.levels, 1, row['level'], row['kind'] == 'kink')
    for speed, inside in (
        (row['speed'], True), (row['low'] * 1.01, True), (row['high'] * 0.99, True),
        (row['low'] * 0.99, False), (row['high'] * 1.01, False),
    ):  # fmt: skip
        arrived = [arrives('byte', chain, each, row['level'], speed) for each in cases]
        assert all(arrived) == inside


def test_what_is_ahead_alternates_and_keeps_its_distance():
    assert ahead(8, 1, 4, 0) == [(), (5, 6)]
    assert ahead(8, 1, 4, 1) == [(5,), (5, 6, 7), (7,)]
    assert ahead(8, 2, 4, 1) == [(6,), (7,)]
