# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The residual monitor: which reads are compared, and with which wall."""

import math

import pytest

from mlmem import EchoReceived, Faults, MemoryElement, Read, SetFaults, Write, load_element
from mlmem.element_file import Element
from mlmem.physics import INTEGRATORS, Specimen
from mlmem.readers.reading import UNDECODABLE
from mlmem_ros.contract.streams import decode_read_shot, encode_read_shot
from mlmem_tools.identification.watching import ResidualMonitor

DAMPING_TIMES = 10.0
"""After these, waves are gone."""


@pytest.fixture(scope='module')
def element():
    """An element at level 1, at rest."""
    element = MemoryElement(load_element('bits_1'))
    element.apply(SetFaults(Faults(sensor_noise=1e-5)))
    element.perform(Write(1))
    element.pass_ticks(math.ceil(DAMPING_TIMES / element.design.eta / element.tick))
    return element


@pytest.fixture(scope='module')
def read(element):
    """The pulses of a read, as they come from its node."""
    run, events = element.apply(Read()), []
    while run.outcome is None:
        events = element.advance() or events
    echoes = [each for each in events if isinstance(each, EchoReceived)]
    return [decode_read_shot(encode_read_shot(element, each)) for each in echoes]


@pytest.fixture
def monitor(element):
    made = Specimen(element.design)
    integrator = INTEGRATORS[element.settings.time.integrator]
    return ResidualMonitor(Element(made, 5e-4 * made.alpha), integrator)


def compare_read(monitor, pulses, procedure='read'):
    """Return how many reads have been compared after one."""
    for each in pulses:
        monitor.take_shot(each)
    monitor.end_procedure(procedure)
    return monitor.compared


@pytest.mark.parametrize(('procedure', 'reads'), [('read', 2), ('write', 1)])
def test_read_after_a_failed_write_is_not_compared(procedure, reads, monitor, read):
    """A failed read moves nothing, so that what spoils the reads can be told."""
    assert {each.level for each in read} == {1}
    assert compare_read(monitor, read) == 1
    assert not monitor.text
    unclear = [each._replace(level=UNDECODABLE) for each in read]
    assert compare_read(monitor, unclear, procedure) == reads
    assert monitor.compared + monitor.skipped == 2


def test_disturbed_read_is_not_compared(monitor, read):
    assert compare_read(monitor, [each._replace(disturbed=True) for each in read]) == 0


def test_last_read_of_a_procedure_is_compared(monitor, read):
    earlier = [each._replace(tick=each.tick - 1, level=0) for each in read]
    assert compare_read(monitor, earlier + read) == 1
    assert not monitor.text  # the wall of level 0 would be another one
    assert monitor.skipped == 1
