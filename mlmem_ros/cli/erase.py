# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem erase`: make the element behind a running node blank."""

from __future__ import annotations

import argparse

from . import request

SUMMARY = 'make the element behind a running node blank'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of this sub-command."""
    request.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Make the request; return the exit status."""
    return request.run(arguments, lambda client: client.erase(), request.describe)
