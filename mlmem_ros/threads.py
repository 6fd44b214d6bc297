# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Threads and everything they wait on, in one place: a test may substitute a scheduler and clock.

Use it by the module's name (`threads.Condition()`), so that a test's substitutes affect everything
created afterwards.
"""

from concurrent.futures import Future
from threading import Condition, Lock, Thread
from time import monotonic, time

__all__ = ['Condition', 'Future', 'Lock', 'Thread', 'monotonic', 'time']
