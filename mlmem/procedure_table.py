# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The table of procedures: what each is called, what it takes and means; and the levels that they
speak of. `mlmem.procedures.STEPS` says where each is done.

Whatever offers procedures follows from it: the device, `~/request`, services, actions, the command
line, the page, the reference and the SROS 2 policy. It is here, beside the layers, because a
client and the command line read it without importing the device.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass
from numbers import Integral
from typing import Any, NamedTuple

from .schema import Description, describe_field, find_descriptions

BLANK = -1
"""Level of an element without a wall."""

UNDECODABLE = -2
"""Level reported when the reading is not clear."""

UNSET_SEED = -1
"""Stands for a seed that stays as it is."""

UNSET_CONTENT = -1
"""Stands for no content in a request to write, and in the parameters that it takes."""

CONTENT_NAMES = ('level', 'word')
"""What a request to write may name its content: the level of one wall, or the word of a register.
"""

JOINT_NAME = 'substrate'
"""The one joint of an element, as named in `~/joint_states`."""


def describe_level(level: int) -> str:
    """Return a level in words."""
    if level >= 0:
        return f'level {level}'
    return 'blank' if level == BLANK else 'undecodable'


def describe_content(name: str, content: int) -> str:
    """Return a content in words, by its name: `level` of one wall, `word` of a register."""
    is_word = name == 'word' and content >= 0
    return f'word {content} ({content:#x})' if is_word else describe_level(content)


@dataclass(frozen=True)
class WholeNumbers:
    """A command whose whole numbers may be of NumPy; it has those of Python."""

    def __post_init__(self) -> None:
        for field, _ in find_descriptions(self):
            value = getattr(self, field.name)
            if isinstance(value, Integral) and not isinstance(value, bool):
                object.__setattr__(self, field.name, int(value))


@dataclass(frozen=True)
class Write(WholeNumbers):
    """Write a level or word and verify it by an echo."""

    level: int = describe_field(
        MISSING, 'level or word to write, from 0; in decimal or as 0xa7', low=0, high=2**53 - 1
    )


@dataclass(frozen=True)
class Read:
    """Fire a probe pulse at either end and decode the echoes."""

    end: str = describe_field(
        '',
        'end whose delay is answered: left, right or both; empty: `read.end`',
        choices=('', 'left', 'right', 'both'),
    )


@dataclass(frozen=True)
class Erase:
    """Make the element blank."""


@dataclass(frozen=True)
class Calibrate:
    """Measure the echo delay of every level, then restore the content."""


@dataclass(frozen=True)
class SelfTest:
    """Test transducers, actuator, erase and every level, then restore the content."""


@dataclass(frozen=True)
class Locate:
    """Measure the position of the wall in cells, or of every wall of a register."""


@dataclass(frozen=True)
class Reset(WholeNumbers):
    """Replace a simulated element by a fresh one, blank or with a given content."""

    content: int = describe_field(
        BLANK, 'level or word that the new element holds; -1: blank', low=BLANK, high=2**53 - 1
    )
    seed: int = describe_field(
        UNSET_SEED,
        'seed with which the random numbers of faults begin anew; -1: they go on',
        low=UNSET_SEED,
        high=2**31 - 1,
    )


@dataclass(frozen=True)
class Survey:
    """Publish pulses through the element in several states for `mlmem fit`, then restore the
    content.
    """


@dataclass(frozen=True)
class Kick:
    """Kick a wall off from the left end, or a kink that takes one away; what rests then is not
    known until a read.
    """

    speed: float = describe_field(
        MISSING, 'mean speed of the end in cells per time unit', low=1e-4, high=10.0
    )


@dataclass(frozen=True)
class Abort:
    """Stop the running procedure and bring the strain to zero.

    Attributes:
        why: The reason, for the outcome of what is stopped.
    """

    why: str = ''


Procedures = Write | Read | Erase | Calibrate | SelfTest | Locate | Reset | Survey | Kick | Abort
"""Commands that take time; their outcome is reported at the end."""


class Procedure(NamedTuple):
    """A row of the table.

    Attributes:
        changes: Whether content or calibration may change: a success is acknowledged when the
            state is saved.
        action: Whether it is also an action, of the name of the command.
        both_ends: Whether it needs a transducer at both ends.
        listens: Whether it fires probe pulses.
    """

    command: type[Any]
    changes: bool = True
    action: bool = True
    both_ends: bool = False
    listens: bool = True

    @property
    def meaning(self) -> str:
        """What it does, as the first paragraph of its command says."""
        first, _, _ = (inspect.getdoc(self.command) or '').partition('\n\n')
        text = ' '.join(first.split()).removesuffix('.')
        return text[:1].lower() + text[1:]

    @property
    def arguments(self) -> Iterator[tuple[str, str, Any, Description]]:
        """Name, type, default (or `MISSING`) and description of every argument."""
        for field, description in find_descriptions(self.command):
            yield field.name, str(field.type), field.default, description

    @property
    def required_arguments(self) -> tuple[str, ...]:
        """Arguments without a default."""
        return tuple(name for name, _, default, _ in self.arguments if default is MISSING)

    @property
    def target_parameters(self) -> Mapping[str, str]:
        """The parameters with what must be given, for a service that takes nothing."""
        return {name: f'target_{name}' for name in CONTENT_NAMES} if self.command is Write else {}

    @property
    def has_service(self) -> bool:
        """Whether a service that takes nothing can begin it; `~/request` can begin all."""
        return not self.required_arguments or bool(self.target_parameters)


PROCEDURES = {
    'write': Procedure(Write),
    'read': Procedure(Read, changes=False),
    'erase': Procedure(Erase),
    'calibrate': Procedure(Calibrate),
    'self_test': Procedure(SelfTest),
    'locate': Procedure(Locate, changes=False, action=False, both_ends=True),
    'reset': Procedure(Reset, action=False),
    'survey': Procedure(Survey, both_ends=True),
    'kick': Procedure(Kick, action=False, listens=False),
    'abort': Procedure(Abort, action=False, listens=False),
}
"""All procedures by name."""
