# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node whose parameters are described: their errors in words, and what rclpy does not check."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterNotDeclaredException,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from mlmem import SettingsError
from mlmem.schema import Description, short_repr

PARAMETER_TYPE_NAMES = {bool: 'a bool', int: 'an integer', float: 'a double', str: 'a string'}
"""The types of parameters, for messages."""


class CheckedParameters(Node):
    """A node whose parameters are described, checked by name and choice, some of them computed;
    rclpy's services of parameters call these methods.

    Attributes:
        parameter_choices: The words that may be set, of those for which not every text may.
        computed_parameters: What returns the value of those that nobody sets, by name.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        """Create the node, with none of them."""
        self.parameter_choices: dict[str, tuple[str, ...]] = {}
        self.computed_parameters: dict[str, Callable[[], Any]] = {}
        super().__init__(*arguments, **options)

    def declare_described(self, declarations: Iterable[tuple[str, Any, Description]]) -> None:
        """Declare parameters that are not declared yet; warn of given ones that there are not.

        Raises:
            SettingsError: A given one has the wrong type or is out of range.
        """
        for name, default, description in declarations:
            if not self.has_parameter(name):
                self._declare_one(name, default, description)
        for name in sorted(self._parameter_overrides):
            if not (self.has_parameter(name) or name.startswith('qos_overrides.')):
                hint = self._suggest_name(name)
                self.get_logger().warning(f'there is no parameter {name}: it is ignored{hint}')

    def _declare_one(self, name: str, default: Any, description: Description) -> None:
        """Declare a parameter.

        Raises:
            SettingsError: The given one has the wrong type or is out of range.
        """
        try:
            value = self.declare_parameter(name, default, build_descriptor(description, default))
        except InvalidParameterTypeException as error:
            hint = ' (a number with a decimal point)' if isinstance(default, float) else ''
            raise SettingsError(
                f'parameter {name} must be {PARAMETER_TYPE_NAMES[type(default)]}{hint}; got '
                f'{self._format_given(name)}'
            ) from error
        except InvalidParameterValueException as error:
            raise SettingsError(
                f'parameter {name} must be from {description.low} to {description.high}; '
                f'got {self._format_given(name)}'
            ) from error
        if description.choices:
            self.parameter_choices[name] = description.choices
            if why := self.not_a_choice(name, value.value):
                raise SettingsError(f'parameter {why}')

    def _format_given(self, name: str) -> str:
        given = self._parameter_overrides.get(name)
        return 'something else' if given is None else repr(given.value)

    def get_value(self, name: str) -> Any:
        """Return the present value of a parameter."""
        return self.get_parameter(name).value

    def not_a_choice(self, name: str, value: Any) -> str:
        """Return why a value is none of the words that may be set; empty if it may."""
        choices = self.parameter_choices.get(name)
        if choices is None or value in choices:
            return ''
        return f'{name} must be one of {", ".join(choices)}; got {short_repr(value)}'

    def _suggest_name(self, name: str) -> str:
        """Return which parameter has a name like this one."""
        alike = difflib.get_close_matches(name, sorted(self.get_parameters_by_prefix('')), 1)
        return f'; did you mean {alike[0]}?' if alike else ''

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters, all or none; an unknown one is refused by its name."""
        for name in (parameter.name for parameter in parameter_list):
            if name and not self.has_parameter(name):  # an empty one is refused when checked
                raise ParameterNotDeclaredException(short_repr(name) + self._suggest_name(name))
        return super().set_parameters_atomically(parameter_list)

    def get_parameter(self, name: str) -> Any:
        """Return a parameter, computed now if it is one of those."""
        if (compute := self.computed_parameters.get(name)) is not None:
            return Parameter(name, value=compute())
        return super().get_parameter(name)


def build_descriptor(description: Description, default: Any) -> ParameterDescriptor:
    """Return the ROS descriptor of a described field, whose type is that of the default."""
    text = description.text + (f' [{description.unit}]' if description.unit else '')
    result = ParameterDescriptor(description=text)
    if description.choices:
        result.additional_constraints = f'one of {", ".join(description.choices)}'
    low, high, number = description.low, description.high, type(default)
    if low is None and high is None:
        return result
    most = sys.float_info.max if number is float else 2**63 - 1
    ends = {
        'from_value': number(-most if low is None else low),
        'to_value': number(most if high is None else high),
    }
    if number is float:
        result.floating_point_range = [FloatingPointRange(**ends)]
    else:
        result.integer_range = [IntegerRange(**ends, step=1)]
    return result
