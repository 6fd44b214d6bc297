# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read disturb: how loud a pulse may be, forecast on a bare chain and tried on the device."""

import dataclasses

import pytest
from sampled import sampled

from mlmem import (
    Abort,
    Erase,
    Locate,
    MemoryElement,
    Read,
    Refused,
    SetStrain,
    Write,
    factory_calibration,
    load_element,
    snapshot,
)
from mlmem.instrument.end import End
from mlmem.physics import find_level
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem_tools.checks import Verdict, disturb
from mlmem_tools.checks.concern import Subject


def as_loud(name, end, A):
    """Return a preset whose pulse of an end has an amplitude; the threshold rises with it."""
    design, settings = load_element(name).design_and_settings
    probe = end.select_probe(settings)
    louder = dataclasses.replace(probe, A=A, v_th=min(1.0, probe.v_th * A / probe.A))
    group = 'probe' if end is End.LEFT else 'probe_right'
    return design, dataclasses.replace(settings, **{group: louder})


def forecast(design, settings):
    (finding,) = disturb.check(Subject(design, settings))
    return finding


@pytest.mark.parametrize(('name', 'end', 'level'), sampled(
    [('case_2', End.LEFT, 0), ('case_2', End.RIGHT, 7), ('bits_2', End.LEFT, 0),
     ('bits_2', End.RIGHT, 3), ('kick_2', End.LEFT, 0)],
    lambda case: case[0] == 'bits_2',
))  # fmt: skip
def test_pulse_limit_is_that_of_the_device(name, end, level):
    """On the whole device: it fires from either end, and rests in between."""
    limit = forecast(*load_element(name).design_and_settings).values[end.value]
    stayed = []
    for share in (1.0, 1.6):
        louder = as_loud(name, end, min(0.5, share * limit))
        element = MemoryElement(
            *louder, factory_calibration(*load_element(name).design_and_settings)
        )
        element.chain.place(find_pinned_wall(element.design, level))
        element.transducer.assume_equilibrium()
        element.perform(Read())
        element.advance(500)
        stayed.append(find_level(element.design, element.chain.configuration) == level)
    assert stayed == [True, False]


def test_read_that_moves_the_wall_fails_the_check():
    """Whatever is set, the limit is the same, but for the steps in which it is found."""
    for A, verdict in ((0.01, Verdict.PASS), (0.1, Verdict.WARN), (0.4, Verdict.FAIL)):
        finding = forecast(*as_loud('bits_2', End.LEFT, A))
        assert finding.verdict is verdict
        assert 0.12 < finding.values['left'] < 0.17


@pytest.mark.parametrize('command', [Read(), Locate(), Write(3), Erase()])
def test_pulse_that_may_move_the_wall_is_rejected(command):
    element = MemoryElement(*as_loud('case_2', End.LEFT, 0.4))
    element.loudest = {End.LEFT: 0.28, End.RIGHT: 0.2}
    before = snapshot.take_snapshot(element)
    with pytest.raises(Refused, match=r'probe.A must be at most 0.28'):
        element.apply(command)
    assert snapshot.take_snapshot(element) == before
    element.apply(SetStrain(0.001))
    assert element.perform(Abort()).success


def test_kicked_element_passes():
    assert forecast(*load_element('kick_2').design_and_settings).verdict is Verdict.PASS
