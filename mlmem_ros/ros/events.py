# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""rclpy's executor of events, without the fault handler that its own function turns on.

The fault handler needs a stderr that is a file, which notebooks and captured tests do not have.
"""

from __future__ import annotations

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.impl.implementation_singleton import rclpy_implementation

from .. import packages


def events_executor(context: Context | None = None) -> Executor:
    """Return an executor that builds no wait set and takes only microseconds for a callback.

    It ignores callback groups, and without a time-out it waits for ever.

    Raises:
        ImportError: rclpy is too old for it, or has changed (see `packages`).
    """
    context = context or rclpy.get_default_context()
    packages.look('rclpy')
    executor: Executor = rclpy_implementation.EventsExecutor(context)
    context.on_shutdown(executor.wake)
    return executor
