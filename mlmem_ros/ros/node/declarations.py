# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every parameter of the node: name, default, meaning. No ROS here: the docs use it, too."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...described import Description, descriptions
from ...device import PRESETS, Preset, preset
from ...device.faults import Faults
from ...device.presets import DEFAULT
from ...device.timetable import FASTEST, SLOWEST
from ...host.design_check import CHOICES
from ...host.settings import (
    DeviceSettings,
    FileSettings,
    PublishSettings,
    QueueSettings,
    RecordSettings,
    StateSettings,
)

LIVE = {
    'target_level': (0, Description('level that `~/write` writes', low=0, high=255)),
    'target_word': ('', Description(
        'the same as text, such as 0xa7, for contents of any size; empty: `target_level`, and '
        'setting that empties it'
    )),
    'time.speed': (
        1.0, Description(
            f'multiple of real time, at least {SLOWEST:g}; 0: as fast as possible',
            low=0.0, high=FASTEST,
        )
    ),
}  # fmt: skip
"""Parameters that may be set at any time, like those of `parameters.LIVE_GROUPS`."""

DIGEST = 'design.digest'
"""What tells one element from another."""

LAW = 'design.law'
"""What brings an on-site law other than the paper's: once set, the law itself, as text."""

OF_THE_NODE = {
    'autostart': (True, Description('configure and activate at start')),
    'actions': (True, Description(
        'serve actions, too: procedures, if mlmem_interfaces is built, and `~/simulate_steps`',
        listed=False,
    )),
    'view': (False, Description(
        'serve the page of this element while the node runs: `mlmem view`'
    )),
    'linger': (0.0, Description(
        'longest time to serve on after SIGINT, until every client has gone; SIGTERM ends it',
        unit='s', low=0.0, high=3600.0,
    )),
    'design.preset': (DEFAULT, Description(
        'shipped element: the defaults of design, actuator, write, erase, probe, probe_right, '
        'read and time', choices=tuple(PRESETS),
    )),
    'design.file': ('', Description(
        'parameter file that brings the element instead of a preset; set at the start'
    )),
    LAW: ('', Description(
        'file of an on-site law, as mlmem law writes it, or its text; scale.length and '
        'scale.stiffness turn it into cells, d is a factor on it, and a, b and c are left out; '
        "empty: the paper's", listed=False,
    )),
    DIGEST: ('', Description(
        'hash of the present design and settings: elements with one are the same'
    )),
    'design.check': ('refuse', Description(
        'what configure does with a design that fails its check', choices=CHOICES
    )),
}  # fmt: skip
"""Parameters that are not fields of settings, and may be set only while unconfigured."""

OF_A_PRESET = (
    'design', 'actuator', 'write', 'erase', 'down_even', 'down_odd', 'up_even', 'up_odd',
    'throw', 'kick', 'push', 'transducer', 'probe', 'probe_right', 'read',
    'register', 'time',
)  # fmt: skip
"""Groups that a preset sets; the others are the robot's."""


def is_listed(name: str, description: Description) -> bool:
    """Return whether every node lists a parameter: what a robot builder changes.

    That is the node's own, the groups of the robot, and what says so; all others come with the
    preset or a file. A node that was given one lists that, too.
    """
    if description.listed is not None:
        return description.listed
    return name in LIVE or name in OF_THE_NODE or name.partition('.')[0] not in OF_A_PRESET


def groups(chosen: Preset | None = None) -> dict[str, Any]:
    """Return the defaults of each group of a preset (that of a new node), by prefix."""
    chosen = chosen or preset(DEFAULT)
    return {
        'device': DeviceSettings(),
        'design': chosen.design,
        **chosen.settings.groups(),
        'publish': PublishSettings(),
        'record': RecordSettings(),
        'state': StateSettings(),
        'files': FileSettings(),
        'queue': QueueSettings(),
        'faults': Faults(),
    }


def declarations(chosen: Preset | None = None) -> Iterator[tuple[str, Any, Description]]:
    """Yield every parameter with its default in a preset (that of a new node)."""
    own = {}
    if chosen and chosen.design.law:
        from ...law_file import text_of  # most elements have the paper's

        own[LAW] = text_of(chosen.design.law)
    for name, (default, description) in {**LIVE, **OF_THE_NODE}.items():
        yield name, own.get(name, default), description
    for prefix, defaults in groups(chosen).items():
        for field, description in descriptions(defaults):
            yield f'{prefix}.{field.name}', getattr(defaults, field.name), description
