# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes forked from one that has loaded all: a start takes a third of the processor time.

Each worker has one such server, which has a single thread and never joins a ROS graph. It forks
twice, so that the new process becomes a child of the worker, their subreaper: status, signals,
group and death with its parent are as `subprocess` makes them.
"""

from __future__ import annotations

import ctypes
import gc
import importlib
import inspect
import os
import pickle
import runpy
import signal
import socket
import subprocess
import sys
import threading
from dataclasses import replace

MODULES = (
    'mlmem_ros.rig',
    'mlmem_ros.ros.client.client',
    'mlmem_ros.ros.node.run',
    'mlmem_tools.cli.request',
    'mlmem_tools.cli.view',
    'trajectory_msgs.msg',
    'type_description_interfaces.msg',
)
"""What nodes and commands import."""

MESSAGES = (
    'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'lifecycle_msgs', 'rcl_interfaces',
    'sensor_msgs', 'service_msgs', 'std_msgs', 'std_srvs', 'trajectory_msgs',
    'type_description_interfaces', 'visualization_msgs',
)  # fmt: skip
"""Packages whose messages they load the C code of."""

PR_SET_CHILD_SUBREAPER = 36
_LOCK = threading.Lock()
_server = None


class Process(subprocess.Popen):
    """A process of Python that ends with its parent, forked from the server."""

    def _execute_child(self, args, executable, preexec_fn, close_fds, pass_fds, cwd, env, *rest):
        pipes = rest[3:9]
        read, _, _, output, _, errors = pipes
        assert args[0] == sys.executable, 'only Python is run'
        streams = [own if n == -1 else n for own, n in enumerate((read, output, errors))]
        self.pid = _fork((args[1:], cwd, dict(os.environ if env is None else env)), streams)
        self._child_created = True
        self._close_pipe_fds(*pipes)


def _fork(order, streams):
    """Return the process id of a child of this process that carries out the order."""
    global _server
    with _LOCK:
        if _server is None:
            _server = _start()
        socket.send_fds(_server, [pickle.dumps(order)], streams)
        return int(_server.recv(16))


def _start():
    """Start the server; return the socket that it listens to, at whose end it ends."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)
    ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    subprocess.Popen([sys.executable, __file__, str(its.fileno())], pass_fds=[its.fileno()])
    its.close()
    return ours


def serve(orders):
    """Fork for every order; return in the new process, with what Python is to run."""
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
    libc = ctypes.CDLL(None)
    libc.prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    # The destructor of LTTng, which rclpy loads, cancels threads that no fork copies: with Kilted
    # it crashed. So what was loaded before is not destroyed; processes that tests really start do.
    libc.on_exit(libc._exit, None)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    orders.send(b'%d' % os.getpid())  # it may be waited for, and interrupted, from now on
    orders.close()
    for own, given in enumerate(streams):
        os.dup2(given, own)
        os.close(given)
    command, folder, environment = pickle.loads(order)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder or '.')
    return command


def run(kind, *command):
    """Run what follows `python` on a command line: -m MODULE, -c PROGRAM or FILE; arguments."""
    sys.path[0] = os.getcwd()
    if kind == '-m':
        sys.argv[1:] = command[1:]
        runpy.run_module(command[0], run_name='__main__', alter_sys=True)
    elif kind == '-c':
        sys.argv = ['-c', *command[1:]]
        exec(command[0], vars(sys.modules['__main__']))
    else:
        sys.path[0] = os.path.dirname(kind)
        sys.argv = [kind, *command]
        runpy.run_path(kind, run_name='__main__')


def load():
    """Import what processes need, load the loops' machine code, and calibrate some elements.

    The first line that a process logs has `inspect` look at every module; here it has done so.
    """
    for module in MODULES:
        importlib.import_module(module)
    from rosidl_generator_py import import_type_support

    from mlmem import MemoryElement, load_element
    from mlmem.element_file import use_kicks

    for package in MESSAGES:
        import_type_support(package)
    case_2 = load_element('case_2')
    for element, time in (
        (case_2, 1e-4),
        (use_kicks(case_2), 1e-5),  # that of `nodes.QUICK`
    ):
        scale = replace(element.settings.scale, time=time)
        MemoryElement(replace(element, settings=replace(element.settings, scale=scale)))
    inspect.getmodule(inspect.currentframe())
    assert threading.active_count() == 1
    gc.freeze()


if __name__ == '__main__':
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    load()
    run(*serve(socket.socket(fileno=int(sys.argv[1]))))
