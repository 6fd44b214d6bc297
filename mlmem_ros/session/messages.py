# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a session records for a replay besides the topics: its start, commands and state hashes.

They are JSON in std_msgs/msg/String messages on topics of their own, so every tool that opens the
bag keeps them, even when it splits the bag.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import platform
from collections.abc import Mapping
from typing import Any

from .. import packages
from ..bag import jazzy
from ..device import Command, MemoryElement, snapshot
from ..physics import ARITHMETIC
from ..version import __version__

FORMAT = 2
"""Version of this format; sessions of format 1 have no digests."""

HEADER = 'session'
COMMAND = 'session/command'
STATE_HASH = 'session/state_hash'
DROPPED = 'session/dropped'
DIGEST = 'session/digest'
"""Topics of a session below the node's name, besides those that the node publishes."""

STRING = 'std_msgs/msg/String'


def header(element: MemoryElement, node: str, parameters: Mapping[str, Any]) -> bytes:
    """Return the message from which a replay starts, as CDR; the node's parameters are for
    information.

    Raises:
        Refused: A procedure runs.
    """
    made, special = element.made, {}
    if made.design != element.design or not made.ideal:
        special['specimen'] = made.as_dict()
    if element.forecast is not None:
        special['forecast'] = element.forecast.as_dict()
    return _string(
        {
            'format': FORMAT,
            'node': node,
            'versions': versions(),
            'seed': element.faults.seed,
            'design': element.design.as_dict(),
            'settings': element.settings.as_dict(),
            'parameters': dict(parameters),
            'initial': snapshot.take(element),
            **special,
        }
    )


def command(tick: int, given: Command) -> bytes:
    """Return the message of a command that took effect at a tick, as CDR."""
    return _string({'tick': tick, **as_dict(given)})


def as_dict(command: Command) -> dict[str, Any]:
    """Return a command as its kind and its values; see `records.command_of`."""
    return {'kind': type(command).__name__, **dataclasses.asdict(command)}


def state_hash(element: MemoryElement) -> bytes:
    """Return the message with the hash of the present state, as CDR.

    It also holds the exact displacements, so that a replay that differs can say by how much.
    """
    v = [number.hex() for number in element.chain.v.tolist()]
    return _string({'tick': element.ticks, 'hash': snapshot.digest(element), 'v': v})


def versions() -> dict[str, str]:
    """Return what the results may depend on: package, arithmetic, libraries, processor."""
    return {
        'mlmem_ros': __version__,
        'arithmetic': ARITHMETIC,
        'python': platform.python_version(),
        **{name: _version(name) for name in ('numpy', 'numba', 'llvmlite')},
        'machine': platform.machine(),
    }


@functools.cache  # looked up on the disk, for which no tick may wait
def _version(package: str) -> str:
    return packages.installed(package) or 'unknown'


def _string(values: dict[str, Any]) -> bytes:
    return jazzy.serialize(jazzy.message(STRING, data=json.dumps(values)))
