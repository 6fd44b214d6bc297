# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The device's procedures, as sequences that the tick loop advances.

A procedure is a generator: what it does before a `yield` takes effect in the following tick. It
yields the number of ticks after which to resume it. Resumed earlier, it does nothing but yield
the remaining number. It never sleeps or reads a clock. It knows only what the device can measure,
the displacements of the two ends, and never the true wall position.
"""

from collections.abc import Callable, Mapping

from ..commands import Outcome
from ..instrument.blocks import Procedure
from ..procedure_table import BLANK
from ..readers.listening import expected_wait
from . import maintenance, surveying, writing

__all__ = ['STEPS', 'Procedure']

STEPS: Mapping[str, tuple[Callable[..., Procedure[Outcome]], Callable[..., float]]] = {
    'write': (writing.write, writing.estimate_write),
    'read': (
        lambda element, end: element.reader.report_content(element, end),
        lambda element, end: expected_wait(element) + element.reader.read_duration(element),
    ),
    'erase': (
        writing.erase,
        lambda element: writing.writing_time(element, writing.find_content(element), BLANK),
    ),
    'calibrate': (maintenance.calibrate, maintenance.estimate_all_levels),
    'self_test': (maintenance.self_test, maintenance.estimate_all_levels),
    'locate': (
        lambda element: element.reader.locate(element),
        lambda element: element.reader.read_duration(element),
    ),
    'reset': (
        maintenance.reset,
        lambda element, content, seed: element.reader.read_duration(element),
    ),
    'survey': (surveying.survey, surveying.estimate_survey),
    'kick': (writing.kick_by_hand, writing.estimate_kick),
    'abort': (
        writing.abort,
        lambda element: element.settings.erase.release if element.actuator.strain else 0.0,
    ),
}
"""How a procedure of the table is done: what begins its generator, and what estimates how long it
will take, in time units. Both take the element and the arguments of its command."""
