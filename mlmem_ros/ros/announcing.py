# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How soon a client finds the node.

Fast DDS greets a newcomer once, mostly before that one can hear, and then speaks every three
seconds: a third of all clients would wait for that, by 1 to 3 s of the time that `mlmem read`
takes. The node speaks more often, and all find it within 0.8 s.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, MutableMapping
from pathlib import Path

PROFILE = Path(__file__).with_name('fast_dds.xml')
"""Profile of Fast DDS that tells how often; other middleware does not look at it."""

NAMES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
"""Variables that name a profile: of Fast DDS 2, which Jazzy has, and of Fast DDS 3."""

FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
"""Profiles in the present folder that they take by themselves."""


def profile_variable(environment: Mapping[str, str]) -> str:
    """Return the variable that names a profile to the Fast DDS that is installed here.

    Each looks at its own, and rmw_fastrtps warns of the older one beside Fast DDS 3.

    Args:
        environment: Of the process.
    """
    prefixes = [*environment.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    return NAMES[any(Path(prefix, 'share', 'fastdds').is_dir() for prefix in prefixes if prefix)]


def announce_often(environment: MutableMapping[str, str]) -> None:
    """Have the process announce itself often, unless it has been given a profile.

    Args:
        environment: Of the process, before it loads the middleware.
    """
    given = any(environment.get(name) for name in NAMES)
    if not given and not any(Path(name).exists() for name in FILES):
        environment[profile_variable(environment)] = str(PROFILE)
