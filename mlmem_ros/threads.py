# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Threads and all that they wait on, so that a test can substitute a scheduler and a clock.

Write `threads.Condition()`, with the module's name, so that substitutes take effect.
"""

from concurrent.futures import Future
from threading import Condition, Lock, Thread
from time import monotonic, time

__all__ = ['Condition', 'Future', 'Lock', 'Thread', 'monotonic', 'time']
