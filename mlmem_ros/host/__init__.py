# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element in service: its life, its requests, its recording, its state file; it knows no ROS.

Every way in ends here in an answer: no exception leaves but one of `REFUSALS`, no request waits
for a disk that hangs.
"""

from .errors import REFUSALS, Overdue
from .host import Host
from .journal import Journal, Log
from .session_plan import SessionPlan
from .sessions import State

__all__ = [
    'REFUSALS',
    'Host',
    'Journal',
    'Log',
    'Overdue',
    'SessionPlan',
    'State',
]
