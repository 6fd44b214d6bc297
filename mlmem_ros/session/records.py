# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a session records for a replay besides the topics: its start, commands and state hashes.

They are JSON in std_msgs/msg/String messages on topics of their own, so every tool that opens the
bag keeps them, even when it splits the bag. Nothing in a file is trusted: every value returned is
finite, of the right type and within bounds; anything else is refused with the name of the field.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, field
from enum import Enum
from typing import Any, cast

import numba

from mlmem import (
    ARITHMETIC_VERSION,
    COMMANDS_BY_NAME,
    Array,
    Calibration,
    Command,
    Design,
    MemoryElement,
    Refused,
    Settings,
    Specimen,
    snapshot,
    steps_per_tick,
)
from mlmem.parsing import DecodeError, decode_value, encode_value, parse_json
from mlmem.schema import Description, describe_field, make_printable, short_repr

from .. import __version__, packages
from ..bag import jazzy
from ..bag.errors import BagError

SESSION_FORMAT = 1
"""Version of this format; a session of another one is rejected."""


class SessionTopic(str, Enum):
    """A topic of a session below the node's name, besides those that the node publishes."""

    HEADER = 'session'
    COMMAND = 'session/command'
    STATE_HASH = 'session/state_hash'
    DROPPED = 'session/dropped'

    def __str__(self) -> str:
        return self.value

    @property
    def type(self) -> str:
        """Name of its message type: JSON, or the running count of messages that were dropped."""
        return 'std_msgs/msg/UInt64' if self is SessionTopic.DROPPED else 'std_msgs/msg/String'


def build_header(element: MemoryElement, node: str, parameters: Mapping[str, Any]) -> bytes:
    """Return the message from which a replay starts, as CDR; the node's parameters are for
    information.

    Raises:
        Refused: A procedure runs.
    """
    made = element.made
    header = Header(
        SESSION_FORMAT,
        element.design,
        element.settings,
        snapshot.take_snapshot(element),
        collect_versions(),
        parameters,
        specimen=None if made.is_ideal and made.design == element.design else made,
        forecast=element.forecast,
        twin=element.twin,
        node=node,
        seed=element.faults.seed,
    )
    return _serialize_json(encode_value(header))


def build_command(tick: int, given: Command) -> bytes:
    """Return the message of a command that took effect at a tick, as CDR."""
    return _serialize_json({'tick': tick, **command_to_dict(given)})


def command_to_dict(command: Command) -> dict[str, Any]:
    """Return a command as its kind and its values."""
    return {'kind': type(command).__name__, **dataclasses.asdict(command)}


def build_state_hash(element: MemoryElement) -> bytes:
    """Return the message with the hash of the present state, as CDR.

    It also holds the exact displacements, so that a replay that differs can say by how much.
    """
    v = [number.hex() for number in element.chain.v.tolist()]
    return _serialize_json({'tick': element.ticks, 'hash': snapshot.hash_state(element), 'v': v})


def collect_versions() -> dict[str, str]:
    """Return what the results may depend on: package, arithmetic, libraries, processor."""
    return {
        'mlmem_ros': __version__,
        'arithmetic': ARITHMETIC_VERSION
        + (' interpreted' if cast(Any, numba.config).DISABLE_JIT else ''),
        'python': platform.python_version(),
        **{name: _find_version(name) for name in ('numpy', 'numba', 'llvmlite')},
        'machine': platform.machine(),
    }


@functools.cache  # looked up on the disk, for which no tick may wait
def _find_version(package: str) -> str:
    return packages.find_installed_version(package) or 'unknown'


def _serialize_json(values: dict[str, Any]) -> bytes:
    return jazzy.encode_message(SessionTopic.HEADER.type, data=json.dumps(values))


@dataclass(frozen=True)
class Header:
    """The start of a session, by the keys in its file."""

    format: int = describe_field(
        MISSING, 'version of the format', low=SESSION_FORMAT, high=SESSION_FORMAT
    )
    design: Design = describe_field(MISSING, 'the element')
    settings: Settings = describe_field(MISSING, "the instrument's settings")
    initial: Mapping[str, Any] = describe_field(
        MISSING, 'its state, which `snapshot.restore_snapshot` checks'
    )
    versions: Mapping[str, str] = describe_field(
        MISSING, 'all that the results may depend on, by name'
    )
    parameters: Mapping[str, Any] = field(default_factory=dict)
    specimen: Specimen | None = describe_field(None, 'the simulated element; null: as designed')
    forecast: Calibration | None = describe_field(None, 'the calibration that a twin forecast')
    twin: Specimen | None = describe_field(None, 'the twin by which a register was read')
    node: str = ''
    seed: int = 0

    def __post_init__(self) -> None:
        for name, given in (('specimen', self.specimen), ('twin', self.twin)):
            if given and given.design.cells != self.design.cells:
                raise ValueError(f'{name} must have the cells and defects of the design')
        try:
            steps_per_tick(self.made, self.settings.time)  # which refuses too long a tick
        except ValueError as error:
            raise ValueError(f'settings: {error}') from error
        if self.forecast:
            self.forecast.check(self.design.levels)
        _ = self.hash_every

    @property
    def made(self) -> Specimen:
        """The simulated element."""
        return self.specimen or Specimen(self.design)

    @property
    def hash_every(self) -> int:
        """Ticks between two hashes."""
        name, given = 'record.hash_every', Description('', low=1, high=10**6)
        return int(decode_value(int, self.parameters.get(name, 500), name, given))

    @property
    def simulated(self) -> bool:
        """Whether it holds the state of a material, which a real element cannot give."""
        return self.initial.get('chain') is not None

    @property
    def calibration(self) -> Calibration:
        """The calibration with which it began; raises BagError without one."""
        with name_errors('the calibration in the session header'):
            calibration: Calibration = decode_value(Calibration, self.initial['calibration'])
            calibration.check(self.design.levels)
        return calibration


@dataclass(frozen=True)
class StateHash:
    """The hash of the material's state after a tick, and its displacements of shape (N,)."""

    tick: int = describe_field(MISSING, 'ticks done', low=0, high=2**53)
    hash: str = describe_field(MISSING, '32 hexadecimal digits')
    v: Array = describe_field(MISSING, 'a list of hexadecimal numbers')

    def __post_init__(self) -> None:
        if len(self.hash) != 32:
            raise ValueError(f'hash must be 32 hexadecimal digits; got {short_repr(self.hash)}')
        if self.v.ndim != 1:
            raise ValueError('v must be a list')


@contextmanager
def name_errors(where: str) -> Iterator[None]:
    """Add the record's name, such as ``'session/command at 12.3 s'``, to any error its content
    causes.

    Raises:
        BagError: The body raised one, or an error caused by values of the wrong type.
    """
    try:
        yield
    except BagError as error:
        raise BagError(f'{where}: {error}', error.code) from error
    except (
        *(ArithmeticError, AttributeError, LookupError, TypeError, ValueError),
        *(RecursionError, MemoryError, Refused),
    ) as error:
        raise BagError(f'{where}: {make_printable(str(error) or repr(error), 300)}') from error


def read_header(text: str) -> Header:
    """Parse the header from JSON.

    Raises:
        BagError: It has another format; the code is `other_format`.
        DecodeError: It is no header.
    """
    values = decode_value(dict[str, Any], parse_json(text))
    if values.get('format') != SESSION_FORMAT:
        raise BagError(
            f'format must be {SESSION_FORMAT}; got {short_repr(values.get("format"))}',
            'other_format',
        )
    header: Header = decode_value(Header, values)
    return header


def read_command(text: str) -> tuple[int, Command]:
    """Parse a tick and its command from JSON; raises `DecodeError`."""
    values = decode_value(dict[str, Any], parse_json(text))
    given = Description('ticks done', low=0, high=2**53)
    tick = decode_value(int, values.pop('tick', None), 'tick', given)
    kind = values.pop('kind', None)
    if not isinstance(kind, str) or kind not in COMMANDS_BY_NAME:
        raise DecodeError.out_of_range('kind', kind, f'one of {", ".join(COMMANDS_BY_NAME)}')
    return tick, decode_value(COMMANDS_BY_NAME[kind], values)


def read_state_hash(text: str) -> StateHash:
    """Parse a state hash from JSON; raises `DecodeError`."""
    found: StateHash = decode_value(StateHash, parse_json(text))
    return found
