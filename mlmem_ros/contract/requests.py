# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request with its arguments, as a client sends it to `~/request`."""

from __future__ import annotations

from typing import Any, NamedTuple

NAME = 'request'
"""The parameter that names the request; all others are its arguments."""


class Type(NamedTuple):
    """A type of rcl_interfaces/msg/ParameterValue.

    Attributes:
        name: Its name, which is also that of its field.
        number: Its number in rcl_interfaces/msg/ParameterType.
    """

    name: str
    number: int

    def of(self, value: Any) -> Any:
        """Return a ParameterValue's value of this type."""
        return getattr(value, f'{self.name}_value')


BOOL, INTEGER, STRING = Type('bool', 1), Type('integer', 2), Type('string', 4)
DOUBLE_ARRAY = Type('double_array', 8)

REQUESTS: dict[str, dict[str, Type]] = {
    'write': {'level': INTEGER},
    'read': {'end': STRING},
    'erase': {},
    'calibrate': {},
    'self_test': {},
    'abort': {},
    'follow': dict.fromkeys(('times', 'strains', 'rates'), DOUBLE_ARRAY),
    'record': {'on': BOOL, 'path': STRING},
}
"""All requests, with the types of their arguments."""


def message_of(name: str, **arguments: Any) -> Any:
    """Return a request as a rcl_interfaces/srv/SetParametersAtomically.Request.

    Args:
        name: One of `REQUESTS`.
        arguments: Its arguments; omitted ones take the command's defaults.
    """
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import SetParametersAtomically

    types = {NAME: STRING, **REQUESTS[name]}
    return SetParametersAtomically.Request(
        parameters=[
            Parameter(
                name=key,
                value=ParameterValue(
                    type=types[key].number, **{f'{types[key].name}_value': value}
                ),
            )
            for key, value in {NAME: name, **arguments}.items()
        ]
    )
