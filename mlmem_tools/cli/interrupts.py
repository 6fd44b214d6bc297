# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a command ends by Ctrl-C, also while the rest loads: nothing here takes time to import."""

from __future__ import annotations

import os
import signal
import time


class Interrupted(KeyboardInterrupt):
    """Ctrl-C while a command runs.

    Where KeyboardInterrupt itself passes an `exec`, such as that of a dataclass, Python ends by
    the signal in the end, even if it was caught.
    """


INTERRUPTED_STATUS = 130
"""Exit status of a command that was interrupted, as of a shell."""

LEAVE_TIMEOUT_S = 5.0
"""Seconds for leaving the ROS graph, in which Ctrl-C does nothing; later it ends the process."""


def handle_interrupts() -> None:
    """Let Ctrl-C raise `Interrupted`, unless this process was started to ignore it."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _raise_interrupted)


def note_outcome() -> None:
    """Note that the outcome is known, before it is told: from here on Ctrl-C comes too late.

    Otherwise a command would tell an answer, and then that it was interrupted.
    """
    if signal.getsignal(signal.SIGINT) is _raise_interrupted:
        until = time.monotonic() + LEAVE_TIMEOUT_S

        def exit_if_late(*_: object) -> None:
            if time.monotonic() > until:
                os._exit(INTERRUPTED_STATUS)

        signal.signal(signal.SIGINT, exit_if_late)


def _raise_interrupted(*_: object) -> None:
    note_outcome()
    raise Interrupted
