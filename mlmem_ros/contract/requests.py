# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request with its arguments, as a client sends it to `~/request`."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..clipped import clipped
from ..procedures import PROCEDURES
from .fields import parameter

NAME = 'request'
"""The parameter that names the request; all others are its arguments."""


DEADLINE = 'deadline'
"""The parameter with the seconds within which a procedure must begin, if others run."""


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
DOUBLE, DOUBLE_ARRAY = Type('double', 3), Type('double_array', 8)

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
        ValueError: There is no such request, or an argument is not of its type.
    """
    from rcl_interfaces.srv import SetParametersAtomically

    if name not in REQUESTS:
        raise ValueError(f'request must be one of {", ".join(REQUESTS)}; got {clipped(name)}')
    types = {NAME: STRING, DEADLINE: DOUBLE, **REQUESTS[name]}
    if strange := [key for key in arguments if key not in types]:
        known = ', '.join(REQUESTS[name]) or 'no arguments'
        raise ValueError(f'{name} takes {known}; got {clipped(strange[0])}')
    given = {NAME: name, **arguments}
    return SetParametersAtomically.Request(
        parameters=[parameter(key, types[key].number, value) for key, value in given.items()]
    )
