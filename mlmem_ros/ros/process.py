# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A process of ours before it loads ROS: the signals that it notes, and its profile for Fast DDS.

A start heeds a signal between two turns of its executor, for it may be in the middle of anything.

With the profile clients find a node soon, its histories begin small, and the start of a bank takes
a time that grows with its elements, not with their square. Its file says how.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import Any

HANDLED_SIGNALS = signal.SIGINT, signal.SIGTERM


class Signals(list[int]):
    """The signals that have come, in their order."""

    def handle_signals(self) -> None:
        """Take note of SIGINT and SIGTERM from now on."""
        for number in HANDLED_SIGNALS:
            signal.signal(number, self._note_signal)

    def ignore(self) -> None:
        """Let no further signal cut the end of the process short."""
        for number in HANDLED_SIGNALS:
            signal.signal(number, signal.SIG_IGN)

    def _note_signal(self, number: int, _: Any) -> None:
        self.append(number)


RECEIVED_SIGNALS = Signals()
"""Those of this process, if it is ours."""


PROFILE_PATH = Path(__file__).with_name('fast_dds.xml')
"""The profile; other middleware ignores it."""

PROFILE_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
"""Variables that name a profile: of Fast DDS 2, which Jazzy has, and of Fast DDS 3."""

DEFAULT_PROFILE_FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
"""Profiles that they load from the current folder by default."""


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
    if not given and not any(Path(name).exists() for name in DEFAULT_PROFILE_FILES):
        environment[find_profile_variable(environment)] = str(PROFILE_PATH)
