# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request that carries its arguments, as a client sends it to `~/request`."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter

Type = Parameter.Type

NAME = 'request'
"""The parameter that says what is asked for; all others are its arguments."""

REQUESTS: dict[str, dict[str, Parameter.Type]] = {
    'write': {'level': Type.INTEGER},
    'read': {'end': Type.STRING},
    'erase': {},
    'calibrate': {},
    'self_test': {},
    'abort': {},
    'follow': dict.fromkeys(('times', 'strains', 'rates'), Type.DOUBLE_ARRAY),
}
"""What may be asked for, and the types of its arguments."""


def message_of(name: str, **arguments: Any) -> SetParametersAtomically.Request:
    """Return the message of a request.

    Args:
        name: One of `REQUESTS`.
        arguments: Its arguments; those that are left out have the command's defaults.
    """
    types = REQUESTS[name]
    given = [
        Parameter(NAME, Type.STRING, name),
        *(Parameter(argument, types[argument], value) for argument, value in arguments.items()),
    ]
    return SetParametersAtomically.Request(
        parameters=[parameter.to_parameter_msg() for parameter in given]
    )
