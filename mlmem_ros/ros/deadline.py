# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A deadline for the end of a process, which even a thread that keeps the GIL for ever meets.

Middlewares were seen to hang while they leave the graph, below a call that holds the GIL; neither
a signal handler nor a timer of Python runs then. A timer of the system calls `_exit` in a thread
that Python does not know of.
"""

from __future__ import annotations

import contextlib
import ctypes
import time

SIGEV_THREAD = 2
"""Notify by calling a function in a new thread; see sigevent(3type)."""


class _Event(ctypes.Structure):
    """`struct sigevent` of Linux on 64-bit machines."""

    _fields_ = (
        ('value', ctypes.c_int64),
        ('signal', ctypes.c_int),
        ('notify', ctypes.c_int),
        ('function', ctypes.c_void_p),
        ('rest', ctypes.c_char * 40),
    )


class _Times(ctypes.Structure):
    """`struct itimerspec`: the interval, and the first time, in s and ns."""

    _fields_ = tuple((name, ctypes.c_long) for name in ('again', 'again_ns', 'first', 'first_ns'))


def exit_within(seconds: float, status: int) -> None:
    """End this process with an exit status (0 to 255) after a time in seconds, unless it has ended
    by then.

    Where the system has no such timer, nothing happens.
    """
    with contextlib.suppress(AttributeError, OSError):
        system = ctypes.CDLL(None)
        clock = system if hasattr(system, 'timer_create') else ctypes.CDLL('librt.so.1')
        leave = ctypes.cast(system._exit, ctypes.c_void_p)
        event = _Event(status, 0, SIGEV_THREAD, leave)
        timer, times = ctypes.c_void_p(), _Times(0, 0, int(seconds), int(seconds % 1.0 * 1e9))
        if clock.timer_create(time.CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)) == 0:
            clock.timer_settime(timer, 0, ctypes.byref(times), None)
