# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The twin beside an element: which reads are compared."""

import math
import time
from dataclasses import replace

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
from test.device import rig


def compared(watcher):
    """Return how many reads have been compared, once the last is."""
    while not watcher.flush():
        time.sleep(0.001)  # or this thread would keep the other from computing
    return watcher.compared


def test_read_after_a_failed_write_is_not_compared(throttled):
    """A failed read moves nothing, so that what spoils the reads can be told."""
    element = MemoryElement(load_element('bits_1'))
    element.apply(SetFaults(Faults(sensor_noise=1e-5)))
    element.perform(Write(1))
    element.pass_ticks(math.ceil(10.0 / element.design.eta / element.tick))  # waves are gone
    clear = rig.events(element, Read())
    assert isinstance(clear[-1], Outcome)
    made = Specimen(element.design)
    watcher = Watcher(Element(made, 5e-4 * made.alpha), element, throttled)
    watcher.hear(clear)
    assert compared(watcher) == 1
    for procedure in ('read', 'write'):
        watcher.hear([
            replace(each, reading=replace(each.reading, level=UNDECODABLE))
            if isinstance(each, EchoReceived)
            else replace(each, procedure=procedure, success=False)
            for each in clear
        ])  # fmt: skip
        assert compared(watcher) == 2, procedure
