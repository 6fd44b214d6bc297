# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request that carries its arguments: what `~/request` is sent, and the command it asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, fields
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python

from ..clipped import clipped
from ..device import (
    Abort,
    Calibrate,
    Command,
    Erase,
    FollowTrajectory,
    Read,
    Refused,
    SelfTest,
    Write,
)

Type = Parameter.Type

NAME = 'request'
"""The parameter that says what is asked for; all others are its arguments."""

REQUESTS: dict[str, tuple[type[Any], dict[str, Parameter.Type]]] = {
    'write': (Write, {'level': Type.INTEGER}),
    'read': (Read, {'end': Type.STRING}),
    'erase': (Erase, {}),
    'calibrate': (Calibrate, {}),
    'self_test': (SelfTest, {}),
    'abort': (Abort, {}),
    'follow': (
        FollowTrajectory,
        dict.fromkeys(('times', 'strains', 'rates'), Type.DOUBLE_ARRAY),
    ),
}
"""What may be asked for: the command it is, and the types of its arguments."""


def message_of(name: str, **arguments: Any) -> SetParametersAtomically.Request:
    """Return the message of a request.

    Args:
        name: One of `REQUESTS`.
        arguments: Its arguments; those that are left out have the command's defaults.
    """
    _, types = REQUESTS[name]
    given = [
        Parameter(NAME, Type.STRING, name),
        *(Parameter(argument, types[argument], value) for argument, value in arguments.items()),
    ]
    return SetParametersAtomically.Request(
        parameters=[parameter.to_parameter_msg() for parameter in given]
    )


def command_of(parameters: Sequence[ParameterMessage]) -> Command:
    """Return the command that a request asks for; its values are for the device to judge.

    Raises:
        Refused: It is no request, or its arguments are not those of the command.
    """
    given = {parameter.name: parameter.value for parameter in parameters}
    if len(given) != len(parameters):
        raise Refused('a request must name every argument once')
    asked = given.pop(NAME, None)
    name = None if asked is None else asked.string_value
    if name not in REQUESTS:
        raise Refused(f'{NAME} must be one of {", ".join(REQUESTS)}; got {clipped(name)}')
    kind, types = REQUESTS[name]
    for argument, value in given.items():
        if argument not in types:
            raise Refused(
                f'{name} must be given {", ".join(types) or "nothing else"}; '
                f'got {clipped(argument)}'
            )
        if value.type != types[argument].value:
            raise Refused(
                f'{argument} must be of type {types[argument].value} '
                f'({types[argument].name.lower()}); got type {value.type}'
            )
    needed = (field.name for field in fields(kind) if field.default is MISSING)
    if missing := [argument for argument in needed if argument not in given]:
        raise Refused(f'{name} must be given {", ".join(missing)}')
    command: Command = kind(
        **{argument: parameter_value_to_python(value) for argument, value in given.items()}
    )
    return command
