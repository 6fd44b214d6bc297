# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the laboratory, a package of its own, adds: commands, and parts of our own commands."""

from __future__ import annotations

from typing import Any

from mlmem_ros.packages import find_entry_points

COMMANDS_GROUP = 'mlmem.commands'
"""Entry points of commands that other packages add; each is a `Command`."""

PARTS_GROUP = 'mlmem.parts'
"""Entry points of what our own commands do only with the laboratory; each is a function."""

PICTURE_PART = 'session_figure'
"""Draws a session to a file: `draw(session, path)`."""

LABORATORY_COMMANDS = ('bench', 'figures', 'study', 'tolerance')
"""Its commands, so that we can say what to install."""


def load_part(name: str) -> Any:
    """Return a part of one of our commands.

    Raises:
        ModuleNotFoundError: The laboratory is not installed.
    """
    if name not in (found := find_entry_points(PARTS_GROUP)):
        raise build_absent_error()
    return found[name].load()


def build_absent_error() -> ModuleNotFoundError:
    """Return the error that says so."""
    return ModuleNotFoundError('the laboratory is not installed', name='mlmem_lab')
