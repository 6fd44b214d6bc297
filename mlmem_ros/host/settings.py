# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every parameter of a node, with its default and meaning. What belongs to an element is in its
file. No ROS here: the pages are made of it, too.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mlmem import (
    MAX_SPEED,
    MIN_SPEED,
    Checked,
    Design,
    ErrorCode,
    Faults,
    Rejected,
    Settings,
    SettingsError,
    Specimen,
)
from mlmem.element_file import ELEMENT_NAMES
from mlmem.procedure_table import UNSET_CONTENT
from mlmem.schema import Description, describe_field, find_descriptions, make_field_factory

from ..contract.topics import Topic


@contextmanager
def name_rejections(place: str = '', owner: str = '') -> Iterator[None]:
    """Say of any rejection in the body where it stands, and in which group of settings.

    Raises:
        SettingsError: Something was rejected.
    """
    try:
        yield
    except Rejected as error:
        raise SettingsError.of_error(error, owner, place) from error


_seconds = make_field_factory('s', 0.0, 3600.0)
_ticks = make_field_factory('ticks', 1, 10**6)


@dataclass(frozen=True)
class FileSettings(Checked):
    """Which files the node may use; set only at start, so that no client can lift it."""

    root: str = describe_field(
        '',
        'folder that every file of the node must stay in, and with which device.address may be '
        'set only at the start; empty: anywhere',
    )

    def confine_path(self, path: str) -> Path:
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
            expected = f'a writable path ({why})'
            raise SettingsError.out_of_range('path', path, expected) from error
        if home and home not in target.parents:
            expected = f'below files.root = {self.root}, and not {target}'
            raise SettingsError(ErrorCode.CONFLICT, 'path', path, expected)
        if target.name in ('', '..'):
            raise SettingsError.out_of_range('path', path, 'the path of a file, not of a folder')
        return target


COLUMN_PERIOD_TICKS = 10
"""Ticks between two columns of `~/image`."""


@dataclass(frozen=True)
class DeviceSettings(Checked):
    """What drives the element, and where it is."""

    driver: str = describe_field(
        'sim', 'driver of the element: sim, rig, or your own as package.module:Class'
    )
    address: str = describe_field(
        '', 'address of the element, in the form that its driver defines'
    )
    retry: float = _seconds(
        0.0,
        'time between two attempts to connect to an element; 0: no second attempt',
    )


def _tick_interval(ticks: int, topic: str) -> Any:
    return _ticks(ticks, f'ticks between two {topic}', low=0)


@dataclass(frozen=True)
class PublishSettings(Checked):
    """How often streams are published, in ticks; 0: never."""

    field_every: int = _tick_interval(20, '~/field')
    wall_every: int = _tick_interval(20, '~/wall')
    joint_states_every: int = _tick_interval(20, '~/joint_states')
    views_every: int = _tick_interval(50, '~/image, and two ~/markers')
    frame_id: str = describe_field(
        'mlmem', "frame of stamped messages; by default the node's full name without its first /"
    )

    @property
    def common_ticks(self) -> int:
        """Most ticks that can be run at once with all streams on time; views may be late.

        Without any stream: those of a column of the image.
        """
        streams = math.gcd(self.field_every, self.wall_every, self.joint_states_every)
        return streams or COLUMN_PERIOD_TICKS


@dataclass(frozen=True)
class RecordSettings(Checked):
    """Where and how a session is recorded."""

    path: str = describe_field(
        '', 'bag directory of a session that starts with the node; empty: none'
    )
    sync_interval: float = _seconds(
        1.0,
        'time within which recorded data is on the disk',
    )
    max_bytes: int = describe_field(
        0,
        'begin a new file once one has this size and no procedure runs; 0: never',
        unit='bytes',
        low=0,
        high=2**31 - 1,
    )
    most_megabytes: float = describe_field(
        0.0,
        'end the session at about this size, checked at every hash; 0: never',
        unit='MB',
        low=0.0,
        high=1e9,
    )
    hash_every: int = _ticks(500, 'ticks between two hashes of the state')
    last_seconds: float = _seconds(
        0.0,
        "seconds of the element's time kept in memory: a session begins with them, and they are "
        'saved if the device fails; 0: none',
    )


@dataclass(frozen=True)
class SessionPlan:
    """What a session records.

    Attributes:
        topics: All published and subscribed topics, by full name.
        parameters: The node's parameters, for the record.
        files: Where it may be.
    """

    node: str
    settings: RecordSettings
    topics: Sequence[Topic] = ()
    parameters: Mapping[str, Any] | None = None
    files: FileSettings = FileSettings()


@dataclass(frozen=True)
class StateSettings(Checked):
    """Where the content is kept between two runs, as a non-volatile memory keeps it."""

    path: str = describe_field('', 'state file; empty: none, every start is blank')
    interval: float = _seconds(60.0, 'period of saves while active; 0: only at the end', high=1e6)


@dataclass(frozen=True)
class QueueSettings(Checked):
    """How requests of different clients wait for their turn."""

    most: int = describe_field(
        8, 'largest number of waiting procedures; 0: refuse them as busy', low=0, high=8
    )


@dataclass(frozen=True)
class Parameters:
    """The complete configuration of a host.

    Attributes:
        check: What configure does with a design that fails its check.
        publish: How often streams are published.
        specimen: The element that a simulation begins with; None: exactly as designed.
        initial_content: Level or word with which a simulated element begins; -1: blank.
        twin: File of the fitted element that this is; empty: none.
    """

    design: Design
    check: str
    settings: Settings
    publish: PublishSettings
    record: RecordSettings
    state: StateSettings
    faults: Faults
    files: FileSettings
    device: DeviceSettings = DeviceSettings()
    queue: QueueSettings = QueueSettings()
    specimen: Specimen | None = None
    initial_content: int = UNSET_CONTENT
    twin: str = ''


LIVE_PARAMETERS = {
    'target_level': (
        UNSET_CONTENT,
        Description(
            'level that `~/write` writes to an element with one wall; -1: not set',
            low=UNSET_CONTENT,
            high=255,
        ),
    ),
    'target_word': (
        UNSET_CONTENT,
        Description(
            'word that `~/write` writes to a register; -1: not set',
            low=UNSET_CONTENT,
            high=2**14 - 1,
        ),
    ),
    'time.speed': (
        1.0,
        Description(
            f'multiple of real time, at least {MIN_SPEED:g}; 0: as fast as possible',
            low=0.0,
            high=MAX_SPEED,
        ),
    ),
    'service_configure_introspection': (  # named as in demo_nodes_py
        'disabled',
        Description(
            'what services publish on ~/NAME/_service_event',
            choices=('disabled', 'metadata', 'contents'),
        ),
    ),
}
"""Parameters that may be set at any time, like the groups `record` and `faults`."""

DESCRIPTION = 'element_description'
"""The element as the text of its file, as `robot_description` is that of a robot."""

ELEMENT_OVERRIDES: dict[str, tuple[Any, Description]] = {
    'write.method': ('', Description(
        'how a level is written; empty: as the element file says',
        choices=('', 'strain', 'kick', 'auto'),
    )),
    'write.attempts': (0, Description(
        'most attempts of a write; 0: as the element file says', low=0, high=100
    )),
    'actuator.present': (True, Description(
        'false: the robot has no actuator, even if the element file has one'
    )),
    'read.end': ('', Description(
        'end that a read probes from; empty: as the element file says',
        choices=('', 'left', 'right', 'both'),
    )),
}  # fmt: skip
"""Parameters that override a setting of the element file, unless they have their default; but for
`write.method` they may be set only while unconfigured.
"""

NODE_PARAMETERS = {
    'element': ('case_2', Description(
        f'{", ".join(ELEMENT_NAMES)}, or the path of an element file, which is read when this is '
        'set',
    )),
    'twin': ('', Description(
        'file of the fitted element that this is: calibrate verifies its forecast, registers are '
        'read by it; empty: none',
    )),
    'initial_content': (UNSET_CONTENT, Description(
        'level or word with which a simulated element begins; -1: blank',
        low=UNSET_CONTENT, high=2**14 - 1,
    )),
    DESCRIPTION: ('', Description(
        'the element as the text of an element file; it follows from `element`'
    )),
    'autostart': (True, Description('configure and activate at start')),
    'actions': (True, Description(
        'serve actions, too',
    )),
    'linger': (0.0, Description(
        'longest time to serve on after SIGINT, until every client has left the graph; SIGTERM '
        'ends it',
        unit='s', low=0.0, high=3600.0,
    )),
    'design.check': ('refuse', Description(
        'what configure does with a design that fails its check',
        choices=('refuse', 'warn', 'skip'),
    )),
}  # fmt: skip
"""Parameters that are not fields of settings; they may be set only while unconfigured."""

GROUPS: dict[str, Any] = {
    'device': DeviceSettings(),
    'publish': PublishSettings(),
    'record': RecordSettings(),
    'state': StateSettings(),
    'files': FileSettings(),
    'queue': QueueSettings(),
    'faults': Faults(),
}
"""Groups of the other parameters, by prefix."""


def declare_parameters() -> Iterator[tuple[str, Any, Description]]:
    """Yield every parameter with its default."""
    tables = LIVE_PARAMETERS, NODE_PARAMETERS, ELEMENT_OVERRIDES
    yield from ((name, *row) for table in tables for name, row in table.items())
    for prefix, defaults in GROUPS.items():
        for field, description in find_descriptions(defaults):
            yield f'{prefix}.{field.name}', getattr(defaults, field.name), description
