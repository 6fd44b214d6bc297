# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""For a robot's own tests: a memory node, its clock and faults, recorded sessions.

::

    def test_the_gait_is_remembered():
        with memory_node({'time.speed': 10.0}) as node, frozen_clock(node) as clock:
            assert clock.finish(node.memory.write(5)).level == 5
"""

from .frozen_clock import FrozenClock, frozen_clock
from .running import NodeApart, NodeHere, RunningNode, faults, isolate, memory_node
from .sessions import ReplayedSession, assert_replays, assert_written

__all__ = [
    'FrozenClock', 'NodeApart', 'NodeHere', 'ReplayedSession', 'RunningNode', 'assert_replays',
    'assert_written', 'faults', 'frozen_clock', 'isolate', 'memory_node',
]  # fmt: skip
