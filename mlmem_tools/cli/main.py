# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command `mlmem`; it handles Ctrl-C before loading the rest."""

from __future__ import annotations

import errno
import os
import signal
import sys
from typing import TYPE_CHECKING

from .interrupts import INTERRUPTED_STATUS, handle_interrupts, note_outcome

if TYPE_CHECKING:
    from collections.abc import Sequence


OUTPUT_ERRORS = errno.EPIPE, errno.ENOSPC, errno.EIO, errno.EFBIG, errno.EDQUOT
"""What may go wrong with a print; a sub-command handles these for its own files."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a sub-command, by default that of the process's command line; return its exit status."""
    if arguments is None:
        handle_interrupts()
    # Read when a sub-command loads numpy. Our matrices are small, and threads of BLAS that wait
    # for each other take the cores: a figure took 12 s of them, not 5.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    given = sys.argv[1:] if arguments is None else arguments
    first = given[0] if given else ''
    if sys.stdout is None:  # closed by the shell, as in `mlmem read >&-`
        return _report_output(first, 'it is closed')
    try:
        from .commands import run_subcommand  # takes up to a second

        status = run_subcommand(given, first)
        note_outcome()
        sys.stdout.flush()
    except OSError as error:
        if error.errno not in OUTPUT_ERRORS or error.filename is not None:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what is left
        seen_enough = isinstance(error, BrokenPipeError)  # who reads it, as head does
        status = 1 if seen_enough else _report_output(first, error.strerror)
    except KeyboardInterrupt:
        from .output import print_failure

        status = print_failure(first, 'interrupted', INTERRUPTED_STATUS)
    if arguments is None:  # Python would die of a signal that finds it leaving
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return status


def _report_output(command: str, why: str | None) -> int:
    from .output import print_failure

    return print_failure(command, f'the output cannot be written: {why}', 1)


if __name__ == '__main__':
    sys.exit(main())
