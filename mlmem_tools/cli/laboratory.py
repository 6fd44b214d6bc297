# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the laboratory, a package of its own, adds: commands, and parts of our own commands."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from typing import Any

from mlmem_ros.packages import find_entry_points

LABORATORY_COMMANDS = ('bench', 'figures', 'study', 'tolerance')
"""Its commands, so that we can say what to install."""


def find_parts() -> dict[str, EntryPoint]:
    """Return what our own commands do only with the laboratory, by name; each is a function."""
    return find_entry_points('mlmem.parts')


def load_part(name: str) -> Any:
    """Return a part of one of our commands.

    Raises:
        ModuleNotFoundError: The laboratory is not installed.
    """
    if name not in (found := find_parts()):
        raise build_absent_error()
    return found[name].load()


def build_absent_error() -> ModuleNotFoundError:
    """Return the error that says so."""
    return ModuleNotFoundError('the laboratory is not installed', name='mlmem_lab')
