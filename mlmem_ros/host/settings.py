# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of the node besides the device's, where it reads and writes, what a session records."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..contract.topics import Topic
from ..described import clipped, described, fields_in
from ..device import Faults, Settings, SettingsError
from ..device.errors import Checked
from ..physics import Design

_seconds = fields_in('s', 0.0, 3600.0)
_ticks = fields_in('ticks', 1, 10**6)


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


ANYWHERE = FileSettings()

IMAGE_COLUMNS = 400
"""Width of an image that covers at least this many ticks."""


@dataclass(frozen=True)
class DeviceSettings(Checked):
    """Which element it is."""

    driver: str = described(
        'sim', 'what drives the element: sim, rig, or package.module:Class of your own'
    )
    address: str = described('', 'where the element is, as its driver understands it')
    specimen: str = described(
        '', 'file of a fitted element, as mlmem fit writes it, to simulate; empty: as designed'
    )
    twin: str = described(
        '',
        'file of the fitted element that this is: calibrate verifies its forecast, a register is '
        'read by it; empty: none',
    )
    retry: float = _seconds(
        0.0,
        'time between two attempts to reach an element that is off at the start, or lost; 0: none',
    )


def _every(ticks: int, topic: str) -> Any:
    return _ticks(ticks, f'ticks between two {topic}', low=0)


@dataclass(frozen=True)
class PublishSettings(Checked):
    """How often streams are published, in ticks; 0: never."""

    field_every: int = _every(20, '~/field')
    wall_every: int = _every(20, '~/wall')
    joint_states_every: int = _every(20, '~/joint_states')
    image_every: int = _every(50, '~/image')
    image_span: int = _ticks(4000, 'ticks that ~/image reaches back', high=10**7)
    markers_every: int = _every(50, '~/markers')
    frame_id: str = described(
        'mlmem', "frame of stamped messages; by default the node's full name without its first /"
    )

    @property
    def column_every(self) -> int:
        """Ticks between two columns of the image."""
        return math.ceil(self.image_span / IMAGE_COLUMNS)

    @property
    def common_ticks(self) -> int:
        """Most ticks that can be run at once with all streams on time; views may be late.

        Without any stream: those of a column of the image.
        """
        streams = math.gcd(self.field_every, self.wall_every, self.joint_states_every)
        return streams or self.column_every


@dataclass(frozen=True)
class RecordSettings(Checked):
    """Where and how a session is recorded."""

    path: str = described('', 'bag directory of a session that starts with the node; empty: none')
    add_time: bool = described(
        True, 'add the time to the name of an existing path; false: refuse an existing path'
    )
    sync_interval: float = _seconds(
        1.0,
        'time within which recorded data is to be safe on the disk; a sync begins at half of it',
    )
    max_bytes: int = described(
        0, 'begin a new file at this size; 0: never', unit='bytes', low=0, high=2**31 - 1
    )
    max_duration: float = _seconds(0.0, 'begin a new file after this time; 0: never', high=1e6)
    most_megabytes: float = described(
        0.0,
        'end the session at about this size, checked at every hash; 0: never',
        unit='MB',
        low=0.0,
        high=1e9,
    )
    hash_every: int = _ticks(500, 'ticks between two hashes of the state')
    last_seconds: float = _seconds(
        0.0,
        "seconds of the element's time kept in memory while active: a session begins with them, "
        'and they are saved if the device fails; 0: none',
    )
    views: bool = described(False, 'record ~/image and ~/markers too: three times the size')


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
    files: FileSettings = ANYWHERE


@dataclass(frozen=True)
class StateSettings(Checked):
    """Where the content is kept between two runs, as a non-volatile memory keeps it."""

    path: str = described('', 'state file; empty: none, every start is blank')
    interval: float = _seconds(
        60.0, 'time between two saves while active; 0: only at the end', high=1e6
    )


@dataclass(frozen=True)
class QueueSettings(Checked):
    """How requests of different clients wait for their turn."""

    most: int = described(
        8, 'most procedures that wait while one runs; 0: refuse them as busy', low=0, high=8
    )
    wait: float = _seconds(
        60.0, 'longest wait of a request that brings no deadline of its own', low=0.1
    )


@dataclass(frozen=True)
class Parameters:
    """The complete configuration of a host.

    Attributes:
        check: What configure does with a design that fails its check.
        publish: How often streams are published.
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
