# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What `~/request` takes: the procedures, a strain profile and a recording, with their arguments;
how a client encodes a request, and how the node decodes it.

Messages check their fields only if ROS_PYTHON_CHECK_FIELDS is 1, and never under `python -O`.
Without a check a text where a number belongs may end the process. So values are checked before
they are converted (`Type.convert`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, dataclass, fields
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, NamedTuple

from mlmem import Refused
from mlmem.procedure_table import CONTENT_NAMES, PROCEDURES, UNSET_CONTENT, Write
from mlmem.schema import short_repr

if TYPE_CHECKING:
    from mlmem import Command


@dataclass(frozen=True)
class Record:
    """A request to the node itself: start or stop recording a session.

    Attributes:
        on: Whether to start.
        path: The bag; if empty, the parameter `record.path`.
    """

    on: bool = True
    path: str = ''


# --- types ------------------------------------------------------------------------------------


class Type(NamedTuple):
    """A type of rcl_interfaces/msg/ParameterValue.

    Attributes:
        name: Its name, which is also that of its field.
        number: Its number in rcl_interfaces/msg/ParameterType.
        kind: What its values are in Python.
        meaning: What a value must be, for errors.
    """

    name: str
    number: int
    kind: Any
    meaning: str

    def of(self, value: Any) -> Any:
        """Return a ParameterValue's value of this type."""
        return getattr(value, f'{self.name}_value')

    def convert(self, name: str, value: Any) -> Any:
        """Return a value as a message takes it; numbers of NumPy are converted.

        Raises:
            ValueError: It is not of this type; the error begins with the name.
        """
        if isinstance(value, self.kind) and isinstance(value, bool) == (self is BOOL):
            if self is DOUBLE_ARRAY and not isinstance(value, str):
                return [DOUBLE.convert(name, item) for item in value]
            if self is INTEGER and -(2**63) <= value < 2**63:
                return int(value)
            if self is DOUBLE:
                with suppress(OverflowError):
                    return float(value)
            if self is BOOL or (self is STRING and '\0' not in value):
                return value
        raise ValueError(f'{name} must be {self.meaning}; got {short_repr(value)}')

    def build_parameter(self, name: str, value: Any) -> Any:
        """Return a rcl_interfaces/msg/Parameter; raises as `convert`."""
        from rcl_interfaces.msg import Parameter

        given = Parameter(name=name)
        given.value.type = self.number
        setattr(given.value, f'{self.name}_value', self.convert(name, value))
        return given


BOOL = Type('bool', 1, bool, 'true or false')
INTEGER = Type('integer', 2, Integral, 'a whole number of at most 64 bits')
DOUBLE = Type('double', 3, Real, 'a number')
STRING = Type('string', 4, str, 'a text without NUL')  # messages end a text there
DOUBLE_ARRAY = Type('double_array', 8, Sequence, 'a list of numbers')


def find_type(name: str, value: Any) -> Type:
    """Return the type of a parameter of the node with a value.

    Raises:
        ValueError: No parameter takes the value.
    """
    for each in (BOOL, INTEGER, DOUBLE, STRING):
        if isinstance(value, each.kind):
            return each
    raise ValueError(f'{name} must be true or false, a number or a text; got {short_repr(value)}')


# --- requests ---------------------------------------------------------------------------------

NAME_ARGUMENT = 'request'
"""The parameter that names the request; all others are its arguments."""

DEADLINE_ARGUMENT = 'deadline'
"""The parameter with the seconds within which a procedure must begin, if others run."""


_TYPES = {'float': DOUBLE, 'int': INTEGER, 'str': STRING}

REQUEST_ARGUMENTS: dict[str, Mapping[str, Type]] = {
    **{
        name: {argument: _TYPES[kind] for argument, kind, *_ in row.arguments}
        for name, row in PROCEDURES.items()
    },
    'write': dict.fromkeys(CONTENT_NAMES, INTEGER),
    'follow': dict.fromkeys(('times', 'strains', 'rates'), DOUBLE_ARRAY),
    'record': {'on': BOOL, 'path': STRING},
}
"""The types of the arguments of all requests, by name."""


def find_command_type(name: str) -> type[Any]:
    """Return the type of the command of a request; a client needs none, and no physics."""
    if name in PROCEDURES:
        return PROCEDURES[name].command
    from mlmem.commands import FollowTrajectory

    return {'follow': FollowTrajectory, 'record': Record}[name]


# --- the client's side ------------------------------------------------------------------------


def build_request(name: str, **arguments: Any) -> Any:
    """Return a request as a rcl_interfaces/srv/SetParametersAtomically.Request; omitted arguments
    take the command's defaults.

    Raises:
        ValueError: There is no such request, or an argument is not of its type.
    """
    from rcl_interfaces.srv import SetParametersAtomically

    if name not in REQUEST_ARGUMENTS:
        raise ValueError(
            f'request must be one of {", ".join(REQUEST_ARGUMENTS)}; got {short_repr(name)}'
        )
    takes = REQUEST_ARGUMENTS[name]
    types = {NAME_ARGUMENT: STRING, DEADLINE_ARGUMENT: DOUBLE, **takes}
    if strange := [key for key in arguments if key not in types]:
        known = ', '.join(takes) or 'no arguments'
        raise ValueError(f'{name} takes {known}; got {short_repr(strange[0])}')
    given = {NAME_ARGUMENT: name, **arguments}
    return SetParametersAtomically.Request(
        parameters=[types[key].build_parameter(key, value) for key, value in given.items()]
    )


def check_content(level: Any) -> int:
    """Return a content to write.

    Raises:
        ValueError: It is not a whole number from 0.
    """
    if isinstance(level, Integral) and not isinstance(level, bool) and int(level) >= 0:
        return int(level)
    raise ValueError(f'level must be a whole number of at least 0; got {short_repr(level)}')


# --- the node's side --------------------------------------------------------------------------


def parse_request(parameters: Sequence[Any]) -> tuple[Command | Record, float]:
    """Return the command in the parameters of a request, whose values the device checks, and the
    seconds for which it waits for its turn; 0 if it does not say so.

    Raises:
        Refused: It is not a request, or has the wrong arguments.
    """
    given = {parameter.name: parameter.value for parameter in parameters}
    if len(given) != len(parameters):
        raise Refused('a request must name every argument once')
    asked = given.pop(NAME_ARGUMENT, None)
    name = None if asked is None else STRING.of(asked)
    if name not in REQUEST_ARGUMENTS:
        raise Refused(
            f'{NAME_ARGUMENT} must be one of {", ".join(REQUEST_ARGUMENTS)}; got '
            f'{short_repr(name)}'
        )
    types, wait = REQUEST_ARGUMENTS[name], 0.0
    if name in PROCEDURES and DEADLINE_ARGUMENT in given:
        value = given.pop(DEADLINE_ARGUMENT)
        wait = float(DOUBLE.of(value)) if value.type == DOUBLE.number else math.nan
        if not wait > 0.0:
            raise Refused(f'{DEADLINE_ARGUMENT} must be a number of seconds above 0')
    for argument, value in given.items():
        if argument not in types:
            raise Refused(
                f'{name} takes {", ".join(types) or "no arguments"}; got {short_repr(argument)}'
            )
        if value.type != types[argument].number:
            raise Refused(
                f'{argument} must be of type {types[argument].number} '
                f'({types[argument].name}); got type {value.type}'
            )
    values = {argument: types[argument].of(value) for argument, value in given.items()}
    return build_command(name, values), wait


def build_command(name: str, given: Mapping[str, Any]) -> Any:
    """Return the command of a request with its arguments, by name.

    Raises:
        Refused: An argument is missing, or level and word disagree.
    """
    kind, values = find_command_type(name), dict(given)
    if kind is Write:
        values = {'level': _select_content(values)}
    needed = (field.name for field in fields(kind) if field.default is MISSING)
    if missing := [argument for argument in needed if argument not in values]:
        raise Refused(f'{name} must be given {", ".join(missing)}')
    return kind(**values)


def _select_content(given: Mapping[str, Any]) -> Any:
    """Return what to write; raises as `build_command`."""
    contents = {
        name: given[name]
        for name in CONTENT_NAMES
        if given.get(name, UNSET_CONTENT) != UNSET_CONTENT
    }
    if not contents:
        raise Refused('write must be given level (of one wall) or word (of a register)')
    first, *others = contents.values()
    if others and others != [first]:
        named = ' and '.join(f'{name} {short_repr(value)}' for name, value in contents.items())
        raise Refused(f'level and word must be the same; got {named}')
    return first


def find_request_name(command: Command) -> str:
    """Return the request for a command, one of `REQUEST_ARGUMENTS`."""
    (name,) = (name for name in REQUEST_ARGUMENTS if type(command) is find_command_type(name))
    return name
