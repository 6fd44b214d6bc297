# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The twin beside an element: which reads are compared, and with which wall."""

import math
import time
from dataclasses import replace

import pytest

from mlmem import (
    EchoReceived,
    Faults,
    MemoryElement,
    Outcome,
    Read,
    SetFaults,
    Write,
    load_element,
)
from mlmem.element_file import Element
from mlmem.physics import Specimen
from mlmem.readers.reading import UNDECODABLE
from mlmem_tools.identification.watcher import Watcher

REST = 10.0
"""Damping times after which waves are gone."""


def last_events(element, command):
    """Return the events of a procedure's last tick, after a rest."""
    element.pass_ticks(math.ceil(REST / element.design.eta / element.tick))
    run, events = element.apply(command), []
    while run.outcome is None:
        events = element.advance() or events
    return events


def compared(watcher):
    """Return how many reads have been compared, once the last is."""
    while not watcher.flush():
        time.sleep(0.001)  # or this thread would keep the other from computing
    return watcher.compared


@pytest.fixture(scope='module')
def read_element():
    """Return an element at level 1, and the events of a read."""
    element = MemoryElement(load_element('bits_1'))
    element.apply(SetFaults(Faults(sensor_noise=1e-5)))
    element.perform(Write(1))
    return element, last_events(element, Read())


@pytest.mark.parametrize(('procedure', 'reads'), [('read', 2), ('write', 1)])
def test_read_after_a_failed_write_is_not_compared(procedure, reads, read_element, throttled):
    """A failed read moves nothing, so that what spoils the reads can be told."""
    element, clear = read_element
    made = Specimen(element.design)
    watcher = Watcher(Element(made, 5e-4 * made.alpha), element, throttled)
    watcher.hear(clear)
    assert compared(watcher) == 1
    unclear = [
        replace(each, reading=replace(each.reading, level=UNDECODABLE))
        if isinstance(each, EchoReceived)
        else replace(each, procedure=procedure, success=False)
        for each in clear
    ]
    assert isinstance(unclear[-1], Outcome)
    watcher.hear(unclear)
    assert compared(watcher) == reads
