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
from typing import Any

from mlmem import Calibration, Command, MemoryElement, Refused, Settings, snapshot
from mlmem.commands import KINDS
from mlmem.instrument.drivers import steps_per_tick
from mlmem.parsing import ANY, DecodeError, decode, from_json
from mlmem.physics import ARITHMETIC, Design, Specimen
from mlmem.physics.potential import Array
from mlmem.schema import Description, described, printable, short_repr

from .. import __version__, packages
from ..bag import jazzy
from ..bag.errors import BagError

FORMAT = 1
"""Version of this format; a session of another one is rejected."""

HEADER = 'session'
COMMAND = 'session/command'
STATE_HASH = 'session/state_hash'
DROPPED = 'session/dropped'
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
    if element.twin is not None:
        special['twin'] = element.twin.as_dict()
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


MOST_TICKS = 2**53
"""Ticks of a device's clock: 500 000 years at the default pace."""

MOST_HASH_EVERY = 10**6
"""Upper bound of `record.hash_every`, the ticks between two hashes; its default is 500."""


_TICK = Description('ticks done', low=0, high=MOST_TICKS)


@dataclass(frozen=True)
class Header:
    """The start of a session, by the keys in its file."""

    format: int = described(MISSING, 'version of the format', low=FORMAT, high=FORMAT)
    design: Design = described(MISSING, 'the element')
    settings: Settings = described(MISSING, "the instrument's settings")
    initial: Mapping[str, Any] = described(MISSING, 'its state, which `snapshot.restore` checks')
    versions: Mapping[str, str] = described(MISSING, 'all that the results may depend on, by name')
    parameters: Mapping[str, Any] = field(default_factory=dict)
    specimen: Specimen | None = described(None, 'the simulated element; null: as designed')
    forecast: Calibration | None = described(None, 'the calibration that a twin forecast')
    twin: Specimen | None = described(None, 'the twin by which a register was read')
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
        name, given = 'record.hash_every', Description('', low=1, high=MOST_HASH_EVERY)
        return int(decode(int, self.parameters.get(name, 500), name, given))

    @property
    def simulated(self) -> bool:
        """Whether it holds the state of a material, which a real element cannot give."""
        return 'state' in self.initial

    @property
    def calibration(self) -> Calibration:
        """The calibration with which it began; raises BagError without one."""
        with naming('the calibration in the session header'):
            calibration: Calibration = decode(Calibration, self.initial['calibration'])
            calibration.check(self.design.levels)
        return calibration


@dataclass(frozen=True)
class StateHash:
    """The hash of the material's state after a tick, and its displacements of shape (N,)."""

    tick: int = described(MISSING, 'ticks done', low=0, high=MOST_TICKS)
    hash: str = described(MISSING, '32 hexadecimal digits')
    v: Array = described(MISSING, 'a list of hexadecimal numbers')

    def __post_init__(self) -> None:
        if len(self.hash) != 32:
            raise ValueError(f'hash must be 32 hexadecimal digits; got {short_repr(self.hash)}')
        if self.v.ndim != 1:
            raise ValueError('v must be a list')


@contextmanager
def naming(where: str) -> Iterator[None]:
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
        raise BagError(f'{where}: {printable(str(error) or repr(error), 300)}') from error


def read_header(text: str) -> Header:
    """Parse the header from JSON; raises `BagError`, for another format with `other_format`."""
    values = _read(dict[str, Any], text)
    if values.get('format') != FORMAT:
        raise BagError(
            f'format must be {FORMAT}; got {short_repr(values.get("format"))}', 'other_format'
        )
    header: Header = _read(Header, values)
    return header


def read_command(text: str) -> tuple[int, Command]:
    """Parse a tick and its command from JSON; raises `BagError`."""
    values = _read(dict[str, Any], text)
    tick = _read(int, values.pop('tick', None), 'tick', _TICK)
    try:
        return tick, command_of(values)
    except Refused as error:
        raise BagError(str(error)) from error


def command_of(data: Mapping[str, Any]) -> Command:
    """Return the command that `as_dict` described.

    Raises:
        Refused: The data do not describe a command.
    """
    values = dict(data)
    kind = values.pop('kind', None)
    if not isinstance(kind, str) or kind not in KINDS:
        raise Refused(f'command must be one of {", ".join(KINDS)}; got {short_repr(kind)}')
    try:
        command: Command = decode(KINDS[kind], values)
    except DecodeError as error:
        raise Refused(f'{kind} has wrong values: {error}') from error
    return command


def read_state_hash(text: str) -> StateHash:
    """Parse a state hash from JSON; raises `BagError`."""
    found: StateHash = _read(StateHash, text)
    return found


def _read(kind: Any, data: Any, name: str = '', given: Description = ANY) -> Any:
    try:
        return decode(kind, from_json(data) if isinstance(data, str) else data, name, given)
    except DecodeError as error:
        raise BagError(str(error)) from error
