# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command `mlmem`; it handles Ctrl-C before loading the rest."""

from __future__ import annotations

import os
import signal
import sys
from typing import TYPE_CHECKING

from .interrupts import INTERRUPTED, heed_interrupts, outcome_known

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a sub-command, by default that of the process's command line; return its exit status."""
    if arguments is None:
        heed_interrupts()
    # Read when a sub-command loads numpy. Our matrices are small, and threads of BLAS that wait
    # for each other take the cores: a figure took 12 s of them, not 5.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    given = sys.argv[1:] if arguments is None else arguments
    first = given[0] if given else ''
    try:
        from .commands import run  # takes up to a second

        status = run(given, first)
        outcome_known()
        sys.stdout.flush()
    except BrokenPipeError:  # who reads it has seen enough, as head does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what is left
        status = 1
    except KeyboardInterrupt:
        from .output import complain

        status = complain(first, 'interrupted', INTERRUPTED)
    if arguments is None:  # Python would die of a signal that finds it leaving
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return status


if __name__ == '__main__':
    sys.exit(main())
