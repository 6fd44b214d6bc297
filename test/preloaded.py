# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes forked from one that has loaded all: a start takes a third of the processor time.

Each worker forks such a server before its first test. It has a single thread and never joins a ROS
graph. It forks twice, so that the new process becomes a child of the worker, their subreaper:
status, signals, group and death with its parent are as `subprocess` makes them. Tests of how a
process starts and loads ask for `real_processes`.
"""

from __future__ import annotations

import ctypes
import faulthandler
import functools
import gc
import inspect
import logging
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading

PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
RUN = 'import runpy; runpy.run_module({!r}, run_name="__main__", alter_sys=True)'
_LOCK = threading.Lock()
_server = None


class Process(subprocess.Popen):
    """A `python -m MODULE ARGUMENT ...` that ends with its parent, forked from the server."""

    def _execute_child(self, args, executable, preexec_fn, close_fds, pass_fds, cwd, env, *rest):
        pipes = rest[3:9]
        read, _, _, output, _, errors = pipes
        assert args[:2] == [sys.executable, '-m'], 'only modules are run'
        streams = [own if n == -1 else n for own, n in enumerate((read, output, errors))]
        order = args[2:], cwd, dict(os.environ if env is None else env)
        with _LOCK:
            socket.send_fds(_server, [pickle.dumps(order)], streams)
            self.pid = int(_server.recv(16))
        self._child_created = True
        self._close_pipe_fds(*pipes)


@functools.cache
def load():
    """Import what processes need, load the loops' machine code, and calibrate the paper's element.

    The first line that a process logs has `inspect` look at every module; here it has done so.
    """
    import mlmem_ros.rig
    import mlmem_ros.ros.fast_dds
    import mlmem_ros.ros.node.run  # noqa: F401
    import mlmem_tools.cli.request
    import mlmem_tools.cli.view  # noqa: F401
    from mlmem_ros.device import new_element, preset

    new_element(*preset('case_2'))
    inspect.getmodule(inspect.currentframe())
    gc.freeze()


def start():
    """Fork the server, which ends with this process."""
    global _server
    load()
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)
    _server, orders = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    if os.fork() == 0:
        try:
            _server.close()
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            _run(_serve(orders))
        finally:
            os._exit(1)
    orders.close()


def _serve(orders):
    """Fork for every order; return in the new process, with the module to run."""
    worker = os.getppid()
    while True:
        order, streams, *_ = socket.recv_fds(orders, 1 << 20, 3)
        if not order:
            os._exit(0)
        if (between := os.fork()) == 0:
            if os.fork() != 0:
                os._exit(0)
            break
        os.waitpid(between, 0)
        for stream in streams:
            os.close(stream)
    while os.getppid() != worker:  # until the process between has ended
        os.sched_yield()
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    orders.send(b'%d' % os.getpid())  # it may be waited for, and interrupted, from now on
    orders.close()
    for own, given in enumerate(streams):
        os.dup2(given, own)
        os.close(given)
    (module, *arguments), folder, environment = pickle.loads(order)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder or '.')
    sys.path[0] = os.getcwd()
    sys.argv[1:] = arguments
    return module


def _run(module):
    """Run a module as Python does, and end as it does; forget that a test runner was here."""
    sys.stdin, sys.stdout = os.fdopen(0, closefd=False), os.fdopen(1, 'w', closefd=False)
    sys.stderr = os.fdopen(2, 'w', buffering=1, errors='backslashreplace', closefd=False)
    sys.excepthook, sys.unraisablehook = sys.__excepthook__, sys.__unraisablehook__
    threading.excepthook = threading.__excepthook__
    faulthandler.disable()
    logging.root.handlers.clear()
    sys.modules.pop(module, None)  # or runpy would warn of it
    python = ctypes.pythonapi
    failed = python.PyRun_SimpleString(RUN.format(module).encode())
    if failed and sys.last_type is KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.raise_signal(signal.SIGINT)
    python.Py_Exit(1 if failed else 0)
