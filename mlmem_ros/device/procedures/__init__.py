# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the device can be asked to do, as sequences that the tick loop advances.

A procedure is a generator: what it does before a `yield` takes effect in the tick that follows.
It yields after how many ticks it wants to go on, and may be asked to at any tick before: then it
has nothing to do yet, and says how many are left.
It never sleeps and never looks at a clock, and it knows only what the device can measure: the
displacements of the two ends, never the true wall position.
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
