# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command `mlmem`; it handles Ctrl-C before loading the rest."""

from __future__ import annotations

import errno
import os
import signal
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


class Interrupted(KeyboardInterrupt):
    """Ctrl-C while a command runs.

    Where KeyboardInterrupt itself passes an `exec`, such as that of a dataclass, Python ends by
    the signal in the end, even if it was caught.
    """


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a sub-command, by default that of the process's command line; return its exit status."""
    if arguments is None and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt_once)
    # Read when a sub-command loads numpy. Our matrices are small, and threads of BLAS that wait
    # for each other take the cores: a figure took 12 s of them, not 5.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    given = sys.argv[1:] if arguments is None else arguments
    first = given[0] if given else ''
    if sys.stdout is None:  # closed by the shell, as in `mlmem read >&-`
        return _report_failure(first, 'the output cannot be written: it is closed', 1)
    try:
        from .commands import run_subcommand  # takes up to a second

        status = run_subcommand(given, first)
        sys.stdout.flush()
    except OSError as error:
        # what may go wrong with a print; a sub-command handles these for its own files
        of_print = errno.EPIPE, errno.ENOSPC, errno.EIO, errno.EFBIG, errno.EDQUOT
        if error.errno not in of_print or error.filename is not None:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what is left
        if isinstance(error, BrokenPipeError):  # who reads it has seen enough, as head does
            return 1
        return _report_failure(first, f'the output cannot be written: {error.strerror}', 1)
    except KeyboardInterrupt:
        return _report_failure(first, 'interrupted', 130)  # as of a shell
    return status


def _interrupt_once(*_: object) -> None:
    """Interrupt the command; it then leaves the ROS graph, which nothing interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise Interrupted


def _report_failure(command: str, why: str, status: int) -> int:
    from .output import print_failure

    return print_failure(command, why, status)


if __name__ == '__main__':
    sys.exit(main())
