# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device from plain values, bit by bit; and values of no such device, which are refused."""

import copy
import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest

from mlmem import Abort, Disturb, FollowTrajectory, Read, SetStrain, Write, snapshot
from mlmem.instrument.end import End
from mlmem.parsing import encode_value
from mlmem.physics import CASE_II, StateError
from mlmem.readers.listening import has_decayed

from . import rig


def elastic():
    """Return a device over an elastic substrate that is being compressed; a rigid one's delays."""
    soft = dataclasses.replace(CASE_II, N=75, substrate='elastic', s_min=100.0, s_max=300.0)
    element = rig.device(1, design=soft)
    rig.ticks(element, SetStrain(-0.03), 7)
    return element


def written_and_moving():
    """Return a device that was written and read, and is being strained by hand."""
    element = rig.device()
    rig.succeed(element, Write(3))
    rig.ticks(element, SetStrain(0.03), 7)
    assert element.actuator.is_moving
    return element


def all_active():
    """Return a device whose wall has left, so that its distance is infinite."""
    element = rig.settle(rig.device(), np.full(rig.DESIGN.N, CASE_II.D_s2))
    assert not element.perform(Read()).success
    assert element.reading.distance == math.inf
    return element


def on_a_trajectory():
    element = rig.device(1)
    through = FollowTrajectory((0.1, 0.2, 0.4), (0.05, -0.01, 0.0), (0.0, -0.5, 0.0))
    rig.ticks(element, through, 60)
    return element


def shaken():
    """Return a device between two accelerations; its time-out comes within 100 ticks."""
    element = rig.device(1)
    rig.ticks(element, Disturb(1e-4), 1, Disturb(-2e-4), 3)
    return element


def pulsed():
    """Return a device in which the pulses of an aborted read are still under way."""
    element = rig.device(2)
    rig.ticks(element, Read(), 15, Abort(), 1)
    assert not has_decayed(element)
    return element


def faulty():
    element = rig.device(1)
    rig.set_faults(
        element, sensor_noise=2e-6, sensor_dropout=0.02, sensor_lag=25.0,
        actuator_offset=1e-3, actuator_lag=50.0, missed_cycle=0.3,
        weak_cell=40, weak_factor=0.97, damping_factor=1.2, seed=11,
        disorder_alpha=0.002, disorder_k_r=0.002, disorder_s=0.05,
    )  # fmt: skip
    rig.ticks(element, 3)
    element.restart_random_numbers(12)
    rig.ticks(element, SetStrain(0.03), 9)
    return element


@pytest.mark.parametrize(
    'make',
    [rig.device, elastic, written_and_moving, all_active, on_a_trajectory, shaken, pulsed, faulty],
    ids=lambda make: make.__name__,
)
def test_restored_device_has_snapshot_and_goes_on_to_bit(make):
    first = make()
    second = rig.device(design=first.design, calibration=first.calibration)
    second.transducer.fire_probe(End.LEFT)  # what it was doing ends
    second.advance()
    values = rig.save_state(first)
    kept = copy.deepcopy(values)
    snapshot.restore_snapshot(second, values)
    assert rig.save_state(second) == kept
    for name in ('reading', 'calibration', 'faults', 'statistics'):
        assert getattr(second, name) == getattr(first, name)
    for element in (first, second):
        told = rig.ticks(element, 100, SetStrain(0.0), 60) + rig.events(element, Read('both'))
        element.told = [rig.plain(event) for event in told]
    assert first.told == second.told
    assert rig.bits(second) == rig.bits(first)
    assert values == kept, 'a device writes into its snapshot'


NAN, INF = math.nan, math.inf

DAMAGE = [
    ('ticks', -5), ('ticks', INF), ('chain.steps', 7), ('chain.V_N', 1.0), ('chain.V_N', NAN),
    ('chain.values', {}), ('chain.values.f8', ''), ('chain.values.shape', [125, 2]),
    ('chain.values.shape', [6, 113]), ('transducer.recent.shape', [144, 2]),
    ('transducer.recent.shape', [288]), ('actuator', {}), ('actuator.strain', 0.0799),
    ('actuator.motion.target', 0.081), ('actuator.motion.start', -1.0),
    ('actuator.motion.duration', -1.0), ('actuator.motion.duration', INF),
    ('actuator.elapsed', -1.0), ('calibration.left.delays', [1.0, 2.0]),
    ('calibration.left.delays', [float(n % 3) for n in range(4)]),
    ('calibration.right.delays', [1.0]), ('calibration.right.blank', NAN),
    ('calibration.left.shapes', [[1.0, 2.0, 0.0]] * 4),  # an echo of no height
    ('calibration.left.shapes', [[1.0, NAN, 2.0]] * 4),
    ('calibration.left.shapes', [[1.0, 2.0, 3.0]]),
    ('calibration.pulse_corrections', {'steps': [{'peak': NAN}] * 4, 'schedule': ''}),
    ('calibration.pulse_corrections', {'steps': [{'times': 0.0}] * 4, 'schedule': ''}),
    ('calibration.pulse_corrections', {'steps': [{'peak': 1.0}], 'schedule': ''}),
    ('reading.level', 4),
    ('reading.level', -3), ('design.gamma', -1e-4), ('design.N', 124), ('statistics.reads', -1),
    ('statistics.level_writes', [0] * 3), ('transducer.returns', {}),
    ('transducer.returns.left.bound', -1.0), ('transducer.returns.right.since', -1),
    ('sensors.late', ...), ('random_since', 10**9), ('random_since', -1), ('last_moved', 10**9),
    ('faults.weak_cell', 126), ('faults.sensor_noise', -1.0), ('linkage.encoder_strain', NAN),
    ('linkage.commanded', 0.01), ('base.acceleration', INF), ('base.silence', 0.5),
]  # fmt: skip
"""Entries of a snapshot and what they are replaced by; ... takes them out. Values of another type
are tried in `test_outside`.
"""

BAD_MOTIONS = [
    ('times', [0.0]), ('times', [0.0, 2.0, 1.0, 4.0]), ('times', [1.0, 2.0, 3.0, 4.0]),
    ('strains', [0.0, 0.0, 0.0, 0.5]), ('rates', [0.0]), ('rates', [0.0, NAN, 0.0, 0.0]),
]  # fmt: skip
"""Of a trajectory through four points."""


def damaged(values, path, value):
    values = copy.deepcopy(values)
    *above, last = path.split('.')
    place = functools.reduce(dict.get, above, values)
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return values


def test_damaged_snapshot_is_rejected_and_changes_nothing(written):
    element = written_and_moving()
    other, before = written(2), rig.bits(element)
    whole = snapshot.take_snapshot(other)
    nested = functools.reduce(lambda inner, _: [inner], range(900), [])
    wrong = [damaged(whole, path, value) for path, value in DAMAGE]
    wrong += [None, [], 'snapshot', 7, {}, damaged(whole, 'statistics.level_writes', nested)]
    arrays = {'chain.values': other.chain.state(), 'transducer.recent': other.transducer.recent}
    for path, number in [*itertools.product(arrays, (NAN, INF)), ('chain.values', 1e13)]:
        numbers = arrays[path].copy()
        numbers[0, 100] = number  # 1e13 is far beyond any real displacement
        wrong.append(damaged(whole, path, encode_value(numbers)))
    moving = snapshot.take_snapshot(on_a_trajectory())
    wrong += [damaged(moving, f'actuator.motion.{name}', value) for name, value in BAD_MOTIONS]
    for values in wrong:
        with pytest.raises(StateError):
            snapshot.restore_snapshot(element, values)
        assert rig.bits(element) == before
    assert element.actuator.is_moving
