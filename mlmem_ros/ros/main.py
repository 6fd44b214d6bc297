# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executable `memory_node`: minds signals from its first moment, then loads all else."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from typing import Any


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one memory node until SIGINT or SIGTERM.

    Signals are ours: rclpy's own handler would shut the context down before the session file is
    closed and before those who wait are answered.

    Args:
        arguments: Command line, the program first; by default that of the process.

    Returns:
        Exit status: 0, or 1 when the node could not be started.
    """
    received: list[int] = []

    def handle(number: int, _: Any) -> None:
        received.append(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handle)
    from .announcing import announce_often
    from .node.command_line import ros_arguments

    announce_often(os.environ)
    given = ros_arguments(sys.argv if arguments is None else arguments)
    from .node.run import run  # a second or two, in which a signal must not raise

    return 0 if received else run(given, received)


if __name__ == '__main__':
    sys.exit(main())
