# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a node knows and does not list, declared when somebody asks for them.

170 names hide the twenty that a robot builder changes. So those of a preset that a robot leaves
alone are not listed: by name they are told and set like any, and what was set is listed. rclpy
takes its time to declare one, and nobody asks for most.
"""

from __future__ import annotations

import difflib
import sys
import threading
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

from ...described import Description, short_repr
from ...device import SettingsError
from ...host.settings import is_listed

ARTICLES = {bool: 'a bool', int: 'an integer', float: 'a double', str: 'a string'}
"""The types of parameters, for messages."""


class LazyParameters:
    """The parameters of a node, declared or not yet.

    Attributes:
        given: Those that the node was started with.
        choices: The words that may be set, of those for which not every text may.
        hidden: Those that the node does not list.
        computed: What tells the value of those that nobody sets, by name.
    """

    def __init__(self, node: Node) -> None:
        """Know none yet."""
        self._node = node
        self.given: dict[str, Parameter] = node._parameter_overrides  # no public way to ask
        self.choices: dict[str, tuple[str, ...]] = {}
        self.hidden = set[str]()
        self.computed: dict[str, Callable[[], Any]] = {}
        self._undeclared: dict[str, tuple[Any, Description]] = {}  # default and description
        self._declaring: str | None = None  # that which is asked for now
        self._lock = threading.RLock()

    def add(self, declarations: Iterable[tuple[str, Any, Description]]) -> None:
        """Declare what is listed or was given, and keep the others until they are asked for.

        Raises:
            SettingsError: A given one has the wrong type or is out of range.
        """
        for name, default, description in declarations:
            if not (is_listed(name, description) or name in self.given):
                self._undeclared[name] = default, description
            elif not self._node.has_parameter(name):
                self.declare(name, default, description)
        self.hidden = set(self._undeclared)
        for name in sorted(self.given):
            if not (self._node.has_parameter(name) or name.startswith('qos_overrides.')):
                told = f'there is no parameter {name}: it is ignored{self._alike(name)}'
                self._node.get_logger().warning(told)

    def declare(self, name: str, default: Any, description: Description) -> Any:
        """Declare a parameter, and return its value.

        Raises:
            SettingsError: The given one has the wrong type or is out of range.
        """
        try:
            value = self._node.declare_parameter(name, default, descriptor(description, default))
        except InvalidParameterTypeException as error:
            hint = ' (a number with a decimal point)' if isinstance(default, float) else ''
            raise SettingsError(
                f'parameter {name} must be {ARTICLES[type(default)]}{hint}; got {self._raw(name)}'
            ) from error
        except InvalidParameterValueException as error:
            raise SettingsError(
                f'parameter {name} must be from {description.low} to {description.high}; '
                f'got {self._raw(name)}'
            ) from error
        if description.choices:
            self.choices[name] = description.choices
            if why := self.not_a_choice(name, value.value):
                raise SettingsError(f'parameter {why}')
        return value.value

    def _raw(self, name: str) -> str:
        return repr(self.given[name].value) if name in self.given else 'something else'

    def value(self, name: str) -> Any:
        """Return the present value; no parameter is declared for it."""
        undeclared = self._undeclared.get(name)
        return undeclared[0] if undeclared else self._node.get_parameter(name).value

    def ask(self, name: str) -> None:
        """Declare a parameter if it is one for which nobody has asked yet."""
        with self._lock:
            if (asked := self._undeclared.pop(name, None)) is not None:
                self._declaring = name
                self.declare(name, *asked)
                self._declaring = None

    def ask_all(self) -> None:
        """Declare all parameters."""
        for name in tuple(self._undeclared):
            self.ask(name)

    def is_declared_now(self, changed: list[Parameter]) -> bool:
        """Return whether a change is that of a parameter that is just being declared."""
        return [parameter.name for parameter in changed] == [self._declaring]

    def not_a_choice(self, name: str, value: Any) -> str:
        """Return why a value is none of the words that may be set; empty if it may."""
        choices = self.choices.get(name)
        if choices is None or value in choices:
            return ''
        return f'{name} must be one of {", ".join(choices)}; got {short_repr(value)}'

    def check_names(self, names: list[str]) -> None:
        """Raise `ParameterNotDeclaredException` for the first that is of no parameter."""
        for name in names:
            if name and not self._node.has_parameter(name):  # an empty one is refused when checked
                raise ParameterNotDeclaredException(short_repr(name) + self._alike(name))

    def _alike(self, name: str) -> str:
        """Return which parameter has a name like this one."""
        known = sorted({*self._node.get_parameters_by_prefix(''), *self._undeclared})
        alike = difflib.get_close_matches(name, known, 1)
        return f'; did you mean {alike[0]}?' if alike else ''


def descriptor(description: Description, default: Any) -> ParameterDescriptor:
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


class UnlistedParameters(Node):
    """A node with such parameters; rclpy's services of parameters call these methods."""

    known: LazyParameters | None = None

    def list_parameters(self, prefixes: list[str], depth: int) -> Any:
        """Return the names of parameters that are listed, and their prefixes."""
        found = super().list_parameters(prefixes, depth)
        if self.known is not None:
            found.names = [name for name in found.names if name not in self.known.hidden]
            found.prefixes = sorted({n.rpartition('.')[0] for n in found.names if '.' in n})
        return found

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters, all or none; an unknown one is refused by its name."""
        if self.known is not None:
            self.known.check_names([parameter.name for parameter in parameter_list])
        return super().set_parameters_atomically(parameter_list)

    def has_parameter(self, name: str) -> bool:
        """Return whether there is such a parameter, listed or not."""
        if self.known is not None:
            self.known.ask(name)
        return bool(super().has_parameter(name))

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return the descriptor of a parameter, listed or not."""
        self.has_parameter(name)
        return super().describe_parameter(name)

    def get_parameters_by_prefix(self, prefix: str) -> Any:
        """Return all parameters with a prefix, listed or not."""
        if self.known is not None:
            self.known.ask_all()
        return super().get_parameters_by_prefix(prefix)

    def get_parameter(self, name: str) -> Any:
        """Return a parameter, computed now if it is one of those."""
        if self.known is not None and (compute := self.known.computed.get(name)) is not None:
            return Parameter(name, value=compute())
        return super().get_parameter(name)
