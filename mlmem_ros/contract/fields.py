# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Values for the fields of messages, checked before they are converted.

Messages check their fields only if ROS_PYTHON_CHECK_FIELDS is 1, and never under `python -O`.
Without a check 65541 becomes 5 in a uint16, and a text where a number belongs may end the process.
"""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

from ..clipped import clipped

NAMES: dict[str, tuple[type, str]] = {
    'boolean': (bool, 'true or false'),
    'string': (str, 'a text'),
    'double': (Real, 'a number'),
}
"""What the fields take that are no whole numbers, by type."""


def fitted(name: str, kind: str, value: Any) -> Any:
    """Return a value as a field takes it.

    Args:
        name: Of the value, for the error.
        kind: Type of the field, as its message calls it, such as `uint16` or `sequence<double>`.
        value: Any value; numbers of NumPy are converted.

    Raises:
        ValueError: The field cannot hold it.
    """
    if kind.startswith('sequence<'):
        if isinstance(value, Sequence) and not isinstance(value, str):
            return [fitted(name, kind[len('sequence<') : -1], item) for item in value]
        raise _unfit(name, 'a list', value)
    if 'int' in kind:
        bits, signed = int(kind[kind.index('int') + 3 :]), not kind.startswith('u')
        low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
        if _is(Integral, value) and low <= value <= high:
            return int(value)
        raise _unfit(name, f'a whole number from {low} to {high}', value)
    wanted, words = NAMES[kind]
    if not _is(wanted, value):
        raise _unfit(name, words, value)
    if wanted is str and '\0' in value:  # messages end a text there
        raise _unfit(name, 'a text without NUL', value)
    try:
        return float(value) if wanted is Real else value
    except OverflowError:
        raise _unfit(name, words, value) from None


def parameter(name: str, number: int, value: Any) -> Any:
    """Return a rcl_interfaces/msg/Parameter; the number is that of its type in ParameterType.

    Raises:
        ValueError: It is not of this type.
    """
    from rcl_interfaces.msg import Parameter, ParameterValue

    field, kind = list(ParameterValue.get_fields_and_field_types().items())[number]
    given = ParameterValue(type=number, **{field: fitted(name, kind, value)})
    return Parameter(name=name, value=given)


def _is(wanted: type, value: Any) -> bool:
    return isinstance(value, wanted) and (wanted is bool or not isinstance(value, bool))


def _unfit(name: str, wanted: str, value: Any) -> ValueError:
    return ValueError(f'{name} must be {wanted}; got {clipped(value)}')
