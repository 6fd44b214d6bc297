# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Threads and all they wait on, in one place: a test may put a scheduler and a clock under them.

To be used by the module's name (`threads.Condition()`), so that what a test puts here is met by
everything that is made afterwards.
"""

from concurrent.futures import Future
from threading import Condition, Lock, Thread
from time import monotonic, time

__all__ = ['Condition', 'Future', 'Lock', 'Thread', 'monotonic', 'time']
