# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element in service: life cycle, requests, recording, state file. No ROS here.

Calls raise only `REFUSALS`, and no request waits for a disk that hangs.
"""

from .host import Host
from .settings import SessionPlan
from .worker import REFUSALS, Overdue, ThrottledLog

__all__ = [
    'REFUSALS',
    'Host',
    'Overdue',
    'SessionPlan',
    'ThrottledLog',
]
