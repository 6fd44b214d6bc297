# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a sub-command writes: what comes from a file or a node is text there, never markup."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from ..clipped import printable

if TYPE_CHECKING:
    from rich.console import Console


def plain_console() -> Console:
    """Return a console that takes every text as it is; styles are given beside it."""
    from rich.console import Console

    return Console(markup=False, emoji=False, highlight=False)


def complain(command: str, error: object) -> None:
    """Tell on the standard error stream, in one line, why a sub-command failed."""
    print(printable(f'mlmem {command}: {error}'), file=sys.stderr)
