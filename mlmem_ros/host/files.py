# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a node reads and writes: anywhere, or only below one folder."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ..clipped import clipped
from ..described import described
from ..device import SettingsError
from ..device.settings import Checked


@dataclass(frozen=True)
class FileSettings(Checked):
    """Where the node may write; set only at start, so that no client can lift it."""

    root: str = described(
        '', 'folder that record.path and state.path must stay in; empty: anywhere'
    )

    def confined(self, path: str) -> Path:
        """Return the path that a parameter names, below the root.

        Args:
            path: The parameter's value. `~` is the home folder; a relative path starts at the
                root, which it must not leave, symbolic links included.

        Raises:
            SettingsError: It leads out of the root, or cannot be a file: `~` of an unknown user,
                a part that is too long, a NUL, or a folder's own name (`/`, `.`, `..`).
        """
        try:
            given = Path(path).expanduser()
            home = Path(self.root).expanduser().resolve() if self.root else None
            target = (home / given).resolve() if home else given
            with suppress(FileNotFoundError, NotADirectoryError):
                os.lstat(target)
        except (OSError, RuntimeError, ValueError) as error:
            why = getattr(error, 'strerror', None) or error
            raise SettingsError(f'{clipped(path)} must be a writable path; {why}') from error
        if home and home not in target.parents:
            raise SettingsError(
                f'{clipped(path)} must lie below files.root = {self.root}; it leads to {target}'
            )
        if target.name in ('', '..'):
            raise SettingsError(f'{clipped(path)} must be the path of a file; it is a folder')
        return target
