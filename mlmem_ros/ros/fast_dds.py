# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The profile of the node for Fast DDS: clients find it soon, its histories begin small, and the
start of a bank takes a time that grows with its elements, not with their square.

Fast DDS announces itself to a newcomer once, mostly before the newcomer can listen, and then every
three seconds. A third of all clients would wait for that, 1 to 3 s in `mlmem read`. The node
announces itself more often, and all clients find it within 0.8 s.

Each end of a topic or service has room for a hundred messages from the start: 36 kB. A node has
116 ends, so that a bank of a hundred would reserve 400 MB.

Fast DDS compares each new end with all others of the process, to join those of one name. The nodes
of a process that we start have nothing to tell each other, so that none need be compared.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, MutableMapping
from pathlib import Path

PROFILE = Path(__file__).with_name('fast_dds.xml')
"""The profile; other middleware ignores it."""

NAMES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
"""Variables that name a profile: of Fast DDS 2, which Jazzy has, and of Fast DDS 3."""

FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
"""Profiles that they load from the current folder by default."""


def profile_variable(environment: Mapping[str, str]) -> str:
    """Return the variable that names a profile for the installed Fast DDS.

    Each version reads its own, and with Fast DDS 3 rmw_fastrtps warns of the older one.
    """
    prefixes = [*environment.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    return NAMES[any(Path(prefix, 'share', 'fastdds').is_dir() for prefix in prefixes if prefix)]


def use_profile(environment: MutableMapping[str, str]) -> None:
    """Make a process that has not loaded the middleware yet use the profile, unless it has one
    already.
    """
    given = any(environment.get(name) for name in NAMES)
    if not given and not any(Path(name).exists() for name in FILES):
        environment[profile_variable(environment)] = str(PROFILE)
