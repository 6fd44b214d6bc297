# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request with its arguments, as a client sends it to `~/request`."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..procedures import PROCEDURES
from .fields import parameter

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

_TYPES = {'bool': BOOL, 'int': INTEGER, 'str': STRING}

REQUESTS: dict[str, dict[str, Type]] = {
    **{
        name: {argument: _TYPES[kind] for argument, kind, *_ in row.arguments}
        for name, row in PROCEDURES.items()
    },
    'follow': dict.fromkeys(('times', 'strains', 'rates'), DOUBLE_ARRAY),
    'record': {'on': BOOL, 'path': STRING},
}
"""All requests, with the types of their arguments."""


def message_of(name: str, **arguments: Any) -> Any:
    """Return one of `REQUESTS` as a rcl_interfaces/srv/SetParametersAtomically.Request; omitted
    arguments take the command's defaults.

    Raises:
        ValueError: An argument is not of its type.
    """
    from rcl_interfaces.srv import SetParametersAtomically

    types = {NAME: STRING, **REQUESTS[name]}
    given = {NAME: name, **arguments}
    return SetParametersAtomically.Request(
        parameters=[parameter(key, types[key].number, value) for key, value in given.items()]
    )
