# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node as a process of its own."""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

NODE = [sys.executable, '-m', 'mlmem_ros.ros.main']

LIBC = ctypes.CDLL(None)
PR_SET_PDEATHSIG = 1


def end_with_parent():
    """Have a process killed when its parent is: a node left over would answer the next run."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def literal(value):
    """Return a value as the ROS command line wants it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"'{value}'" if isinstance(value, str) else repr(value)


class NodeProcess:
    """A running memory_node.

    Args:
        folder: Where its standard error is kept.
        parameters: Parameters by name.
        file: Parameter file.
        name: Name of the node, `mlmem` unless given.
        namespace: Its namespace.
        options: Plain options of the executable.
    """

    def __init__(
        self, folder: Path, parameters=(), file=None, name=None, namespace=None, options=()
    ):
        command = [*NODE, *options, '--ros-args']
        if file is not None:
            command += ['--params-file', str(file)]
        for key, value in dict(parameters).items():
            command += ['-p', f'{key}:={literal(value)}']
        if name is not None:
            command += ['-r', f'__node:={name}']
        if namespace is not None:
            command += ['-r', f'__ns:={namespace}']
        self.element = f'{(namespace or "").rstrip("/")}/{name or "mlmem"}'
        with tempfile.NamedTemporaryFile(
            dir=folder, prefix='node-', suffix='.txt', delete=False
        ) as out:
            self._output = Path(out.name)
            self._process = subprocess.Popen(
                command, stdout=out, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                preexec_fn=end_with_parent,
            )  # fmt: skip

    @property
    def output(self):
        """All it has said, on both of its streams."""
        return self._output.read_text()

    @property
    def running(self):
        return self._process.poll() is None

    def signal(self, number):
        self._process.send_signal(number)

    @property
    def pid(self):
        return self._process.pid

    def exit_status(self, within=20.0):
        """Wait for its end; negative: the signal that killed it."""
        return self._process.wait(within)

    def terminate(self):
        """Ask it to end, if it still runs."""
        if self.running:
            self.signal(signal.SIGTERM)

    def stop(self):
        """Wait for its end, and end it by force if it takes too long."""
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
