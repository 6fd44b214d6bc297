# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes that end with their parent, `memory_node` among them, and its command line."""

from __future__ import annotations

import ctypes
import json
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from os import PathLike
from typing import Any

PR_SET_PDEATHSIG = 1

Parameters = Mapping[str, bool | int | float | str]


def run_node_process(
    arguments: Sequence[str], **streams: Any
) -> AbstractContextManager[subprocess.Popen[bytes]]:
    """Run a memory node; see `run_child_process`."""
    return run_child_process('mlmem_ros.ros.main', arguments, **streams)


@contextmanager
def run_child_process(
    module: str, arguments: Sequence[str], **streams: Any
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a module as a process with these arguments and streams (see `subprocess.Popen`); it gets
    SIGTERM in the end, and is killed if this process or the thread that started it ends.
    """
    command = [sys.executable, '-m', module, *arguments]
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, preexec_fn=_end_with_parent, **streams
    )
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _end_with_parent() -> None:
    """Have this process killed with its parent: a leftover node would answer the next client."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def build_node_arguments(
    element: str, parameters: Parameters | None = None, file: str | PathLike[str] | None = None
) -> list[str]:
    """Return the ROS command line of a node, from its full name, parameters and a file."""
    namespace, _, name = element.rpartition('/')
    given = [f'{key}:={_format_literal(value)}' for key, value in (parameters or {}).items()]
    remaps = [f'__node:={name}', *([f'__ns:=/{namespace.lstrip("/")}'] if namespace else [])]
    return [
        '--ros-args',
        *(('--params-file', str(file)) if file is not None else ()),
        *(word for each in given for word in ('-p', each)),
        *(word for each in remaps for word in ('-r', each)),
    ]


def _format_literal(value: bool | float | str) -> str:
    """Return a value in the syntax of the ROS command line."""
    if isinstance(value, bool):
        return str(value).lower()
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)
