# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads and writes as wear: no read moves the wall, and writes are counted."""

import dataclasses

import numpy as np
import pytest

from mlmem import Abort, Erase, Faults, Read, SetFaults, Write
from mlmem.move_settings import WriteSettings
from mlmem.physics import CASE_II

from . import rig


def read_many(level, end, times, design=rig.DESIGN):
    """Read many times; return by how much the wall and any cell have moved when at rest."""
    element = rig.device(level, design=design)
    position, v = rig.wall(element), element.chain.v.copy()
    for _ in range(times):
        assert rig.succeed(element, Read(end)).level == level
    rig.ticks(element, 400)  # 8000 time units: what still rang has faded by exp(-16)
    assert element.statistics.reads == times
    return abs(rig.wall(element) - position), np.abs(element.chain.v - v).max()


@pytest.mark.parametrize(('level', 'end'), [(0, 'left'), (3, 'right')])
def test_reads_move_no_wall(level, end):
    """The pulse is a hundredth of a cell, of which damping alone leaves 1e-8 of a cell."""
    moved, changed = read_many(level, end, 15)
    assert moved < 1e-8
    assert changed < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize(
    ('level', 'end', 'times'), [(3, 'left', 10_000), (7, 'both', 2000)], ids=str
)
def test_10_000_reads_move_no_wall(level, end, times):
    """Measured: 1e-12 of a cell at level 3, 5e-10 at level 7."""
    moved, changed = read_many(level, end, times, CASE_II)
    assert moved < 1e-8
    assert changed < 1e-8


@pytest.mark.parametrize(
    ('level', 'weak'), [(1, {'tension': 0.034}), (2, {'compression': -0.0195})], ids=str
)
def test_weak_peak_is_compensated_by_next_attempt(level, weak):
    """0.034 and -0.0195 do not free the wall; a tenth more does."""
    element = rig.device(level, write=WriteSettings(**weak))
    outcome = rig.run(element, Write(level + 1))
    assert outcome.success, outcome.error
    assert outcome.attempts == 2
    assert rig.holds(element, level + 1)
    patient = rig.device(level, write=WriteSettings(**weak, escalation=1.0))
    assert not rig.run(patient, Write(level + 1)).success


def peaks(element, command):
    """Return the greatest strain of each attempt of a one-step write."""
    return rig.cycles(rig.strains(element, command)[0])


def test_force_is_bounded_and_reset_for_next_write():
    weak = WriteSettings(tension=0.01, attempts=6, escalation=1.2, escalation_limit=1.5)
    element = rig.device(1, write=weak)
    expected = 0.01 * np.minimum(1.2 ** np.arange(6), 1.5)
    for _ in range(2):
        assert peaks(element, Write(2)) == pytest.approx(expected, rel=1e-12)


def test_no_force_exceeds_actuators_limit():
    weak = WriteSettings(tension=0.01, attempts=3, escalation=1.5, escalation_limit=4.0)
    feeble = {
        'actuator': dataclasses.replace(rig.Settings().actuator, max_strain=0.0121),
        'write': dataclasses.replace(weak, compression=-0.01, start_strain=0.01),
        **rig.with_group('erase', compression=-0.01, tension=0.01, start_strain=-0.01),
    }
    assert peaks(rig.device(1, **feeble), Write(2)) == pytest.approx([0.01, 0.0121, 0.0121])


def test_history_of_element_is_counted():
    """A blank element is read from its right end, whichever is asked; not in loud noise."""
    element = rig.device(1, write=WriteSettings(tension=0.034))
    for command in (Write(2), Write(2), Read(), Read('left'), Write(1), Erase(), Read('left')):
        rig.run(element, command)
    element.apply(SetFaults(Faults(sensor_noise=0.01)))  # as loud as the pulse
    assert not rig.run(element, Read()).success
    element.apply(SetFaults(Faults()))
    element.apply(Write(3))
    rig.ticks(element, 10)
    rig.run(element, Abort())
    counted = element.statistics
    assert (counted.writes, counted.first_try, counted.retries, counted.failures) == (3, 2, 1, 0)
    assert (counted.reads, counted.undecodable) == (4, 1)  # the last in noise
    assert (counted.erases, counted.aborted) == (1, 1)
    assert counted.level_writes == [0, 1, 2, 0]
    assert counted.cycles >= 2 + 2 + 1
    told = counted.as_dict()
    assert told['mean_ticks_2'] == counted.level_ticks[2] / 2
    assert 'mean_ticks_0' not in told
    assert told['retries'] == 1
    failing = rig.device(1, write=WriteSettings(tension=0.005, attempts=2))
    rig.run(failing, Write(2))
    counted = failing.statistics
    assert (counted.writes, counted.failures, counted.retries) == (1, 1, 1)
    assert counted.level_writes == [0] * 4
