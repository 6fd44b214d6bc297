# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""For a robot's own tests: a memory node beside them, and recorded sessions that run again.

pytest_plugins = ['mlmem_ros.testing']

def test_the_gait_is_remembered(replay_session):
    session = replay_session('examples/gait_store/bag')
    session.assert_levels([-1, 1, 1, 3, 3])
"""

from .node import memory_node
from .running import RunningNode
from .sessions import ReplayedSession, replay_session

__all__ = ['ReplayedSession', 'RunningNode', 'memory_node', 'replay_session']
