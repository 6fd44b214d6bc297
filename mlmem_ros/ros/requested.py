# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command that a request to `~/request` asks for; a client needs none of this."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, fields
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rclpy.parameter import parameter_value_to_python

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
from .requests import NAME, REQUESTS

COMMANDS: dict[str, type[Any]] = {
    'write': Write,
    'read': Read,
    'erase': Erase,
    'calibrate': Calibrate,
    'self_test': SelfTest,
    'abort': Abort,
    'follow': FollowTrajectory,
}
"""The command that each of `REQUESTS` is."""


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
    kind, types = COMMANDS[name], REQUESTS[name]
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
