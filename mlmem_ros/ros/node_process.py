# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Processes of ours: what one does before it loads ROS, and child processes that end with their
parent, `memory_node` among them, with its command line.

A start heeds a signal between two turns of its executor, for it may be in the middle of anything.

With our profile of Fast DDS clients find a node soon, its histories begin small, and the start of
a bank takes a time that grows with its elements, not with their square. Its file says how.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

received_signals: list[int] = []
"""The signals that have come to this process, in their order, since it handles them."""


def handle_signals() -> None:
    """Take note of SIGINT and SIGTERM from now on."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: received_signals.append(number))


def ignore_signals() -> None:
    """Let no further signal cut the end of the process short."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


PROFILE_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
"""Variables that name a profile: of Fast DDS 2, which Jazzy has, and of Fast DDS 3."""


def find_profile_variable(environment: Mapping[str, str]) -> str:
    """Return the variable that names a profile for the installed Fast DDS.

    Each version reads its own, and with Fast DDS 3 rmw_fastrtps warns of the older one.
    """
    prefixes = [*environment.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    return PROFILE_VARIABLES[
        any(Path(prefix, 'share', 'fastdds').is_dir() for prefix in prefixes if prefix)
    ]


def use_profile(environment: MutableMapping[str, str]) -> None:
    """Make a process that has not loaded the middleware yet use the profile, unless it has one
    already.
    """
    given = any(environment.get(name) for name in PROFILE_VARIABLES)
    # loaded from the current folder by default
    loaded = 'DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml'
    if not given and not any(Path(name).exists() for name in loaded):
        profile = Path(__file__).with_name('fast_dds.xml')  # other middleware ignores it
        environment[find_profile_variable(environment)] = str(profile)


ParameterValues = Mapping[str, bool | int | float | str]


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
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # 1: PR_SET_PDEATHSIG


def build_node_arguments(
    element: str,
    parameters: ParameterValues | None = None,
    file: str | PathLike[str] | None = None,
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
