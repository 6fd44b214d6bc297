# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The device's procedures, as sequences that the tick loop advances.

A procedure is a generator: what it does before a `yield` takes effect in the following tick. It
yields the number of ticks after which to resume it. Resumed earlier, it does nothing but yield
the remaining number. It never sleeps or reads a clock. It knows only what the device can measure,
the displacements of the two ends, and never the true wall position.
"""

from .aborting import abort
from .blocks import Procedure, Result, run
from .calibrating import calibrate
from .erasing import erase
from .listening import read
from .self_testing import self_test
from .writing import write

__all__ = [
    'Procedure',
    'Result',
    'abort',
    'calibrate',
    'erase',
    'read',
    'run',
    'self_test',
    'write',
]
