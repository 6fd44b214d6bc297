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


def events_executor(context: Context | None = None) -> Executor:
    """Return an executor that builds no wait set and takes only microseconds for a callback.

    It ignores callback groups, and without a time-out it waits for ever.

    Args:
        context: The ROS context, by default that of the process.

    Raises:
        ImportError: rclpy is older than 7.1.4.
    """
    context = context or rclpy.get_default_context()
    if not hasattr(rclpy_implementation, 'EventsExecutor'):
        raise ImportError(
            'rclpy must be 7.1.4 or later; update it: sudo apt upgrade ros-jazzy-rclpy'
        )
    executor: Executor = rclpy_implementation.EventsExecutor(context)
    context.on_shutdown(executor.wake)
    return executor
