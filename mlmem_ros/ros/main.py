# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executables `memory_node` and `memory_bank`; they handle signals before loading the rest."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from .process import RECEIVED


def main(arguments: Sequence[str] | None = None, several: bool = False) -> int:
    """Run one memory node, or as `memory_bank` several, until SIGINT or SIGTERM, with the
    process's command line by default; return the exit status of `node.run`.

    We handle signals ourselves: rclpy's handler would shut the context down before the session
    file is closed and pending requests are answered.
    """
    RECEIVED.heed()
    from .node.command_line import bank_arguments, ros_arguments
    from .process import use_profile

    use_profile(os.environ)
    given = sys.argv if arguments is None else arguments
    given, elements = bank_arguments(given) if several else (ros_arguments(given), ({},))
    from .node.run import run  # takes a second or two, in which a signal must not raise

    if RECEIVED:
        RECEIVED.ignore()
        return 0
    return run(given, RECEIVED, elements)


def bank(arguments: Sequence[str] | None = None) -> int:
    """Run several memory nodes in one process, as `main` runs one."""
    return main(arguments, several=True)


if __name__ == '__main__':
    sys.exit(main())
