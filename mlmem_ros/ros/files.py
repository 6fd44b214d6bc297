# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the node may write: anywhere it is told to, or below one folder alone."""

from __future__ import annotations

from pathlib import Path

from ..device import SettingsError


def confined(path: str, root: str) -> Path:
    """Return the path that a parameter means, which lies below the root.

    Args:
        path: As it was given; `~` is the home folder, a relative path starts at the root.
        root: The folder it has to stay in, symbolic links and all; empty: it may lie anywhere.

    Raises:
        SettingsError: It leads out of the root.
    """
    given = Path(path).expanduser()
    if not root:
        return given
    home = Path(root).expanduser().resolve()
    target = (home / given).resolve()
    if home not in target.parents:
        raise SettingsError(f'{path!r} must lie below files.root = {root}; it leads to {target}')
    return target
