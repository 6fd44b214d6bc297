# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters, declared from the descriptions of the settings they fill."""

from __future__ import annotations

import dataclasses
import difflib
import sys
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ...described import Description, descriptions
from ...device import PRESETS, SettingsError, drivers, preset
from ...device.settings import Settings
from ...host import Host
from ...host.design_check import SKIP, WAS_SKIP
from ...host.files import confined
from ...host.settings import Parameters
from ...physics import DesignError
from .declarations import AUTOSTART, CHECK, LIVE, OF_A_PRESET, PRESET, VIEW, groups


class ParameterError(ValueError):
    """A parameter has the wrong type or value; the message names it."""


LIVE_GROUPS = ('record', 'faults')
"""Groups that may be set at any time: one applies to the next session, one to the device."""

PATHS = ('record.path', 'state.path')
"""Parameters that make the node write files."""

CHOSEN = {'design.preset': PRESET[1], 'design.check': CHECK[1]}
"""Parameters of the group `design` that are not fields of the design."""


class ParameterSet:
    """Declares every parameter of the contract, validates them, and returns their values."""

    def __init__(self, node: Node, host: Host) -> None:
        """Declare all parameters.

        Args:
            node: The node.
            host: Returns whether it is active.

        Raises:
            ParameterError: One has the wrong type or is out of range, or the values do not make a
                memory.
            SettingsError: Settings of different groups contradict each other.
        """
        self._node = node
        self._host = host
        self.locked = False
        """Whether the node is configured, so that only live parameters may be set."""
        name = _declare(node, 'design.preset', *PRESET)
        try:
            chosen = preset(name)
        except DesignError as error:
            raise ParameterError(f'parameter design.{error}') from error
        overrides = node._parameter_overrides  # rclpy has no public way to ask
        if (check := overrides.get('design.check')) is not None:
            overrides['design.check'] = self._modern(check)
        _declare(node, 'design.check', *CHECK)
        self._defaults = groups(chosen)
        self._defaults['publish'] = dataclasses.replace(
            self._defaults['publish'], frame_id=node.get_fully_qualified_name()[1:]
        )
        for prefix, defaults in self._defaults.items():
            for field, description in descriptions(defaults):
                _declare(
                    node, f'{prefix}.{field.name}', getattr(defaults, field.name), description
                )
        for live, (default, description) in LIVE.items():
            _declare(node, live, default, description)
        _declare(node, 'autostart', *AUTOSTART)
        _declare(node, 'view', *VIEW)
        started = node.get_parameter('device.driver').value  # no client can import others
        self._drivers = dict.fromkeys((drivers.SIMULATION, *drivers.SHIPPED, started))
        _warn_of_strangers(node)
        self._limit_level(self.values().design.levels)
        node.add_pre_set_parameters_callback(self._meant)  # with two, rclpy would use both answers
        node.add_on_set_parameters_callback(self._check)

    def values(self) -> Parameters:
        """Return the present values.

        Raises:
            ParameterError: The values do not make a memory.
            SettingsError: Settings of different groups contradict each other.
        """
        check, (_, description) = self._node.get_parameter('design.check').value, CHECK
        if check not in description.choices:
            raise ParameterError(
                f'parameter design.check must be one of {", ".join(description.choices)}; '
                f'got {check!r}'
            )
        given = {prefix: self._group(prefix) for prefix in self._defaults}
        own = ('device', 'design', 'publish', 'record', 'state', 'files', 'faults')
        parts = {name: given.pop(name) for name in own}
        return Parameters(check=check, settings=Settings(**given), **parts)

    def lock(self, levels: int) -> None:
        """Allow only live parameters from now on, and levels below `levels`."""
        self._limit_level(levels)
        self.locked = True

    def _group(self, prefix: str) -> Any:
        defaults = self._defaults[prefix]
        values = {
            field.name: self._node.get_parameter(f'{prefix}.{field.name}').value
            for field, _ in descriptions(defaults)
        }
        try:
            return type(defaults)(**values)
        except (DesignError, SettingsError) as error:  # what ranges alone cannot express
            raise ParameterError(f'parameters {prefix}.*: {error}') from error

    def _limit_level(self, levels: int) -> None:
        """Give `target_level` the range of the design."""
        default, description = LIVE['target_level']
        limited = dataclasses.replace(description, high=max(0, levels - 1))
        present = self._node.get_parameter('target_level').value
        if not 0 <= present < max(1, levels):
            raise ParameterError(
                f'parameter target_level must be from 0 to {levels - 1}; got {present}'
            )
        described = descriptor(limited, default)
        described.type = ParameterType.PARAMETER_INTEGER
        self._node.set_descriptor('target_level', described)

    def _check(self, changed: list[Parameter]) -> SetParametersResult:
        for parameter in changed:
            if parameter.name == 'use_sim_time' and self._host.loop is not None:
                return SetParametersResult(
                    successful=False,
                    reason='use_sim_time may be set only while the node is not active',
                )
            live = parameter.name in LIVE or parameter.name.split('.')[0] in LIVE_GROUPS
            if self.locked and not live and parameter.name != 'use_sim_time':
                return SetParametersResult(
                    successful=False,
                    reason=f'{parameter.name} may be set only while the node is unconfigured',
                )
            if parameter.name == 'files.root':
                return SetParametersResult(
                    successful=False, reason='files.root may be set only at the start of the node'
                )
            if parameter.name == 'device.driver' and parameter.value not in self._drivers:
                return SetParametersResult(
                    successful=False,
                    reason='device.driver may name a class only at the start of the node; now it '
                    f'may be {", ".join(self._drivers)}',
                )
            if parameter.name in PATHS and parameter.value:
                try:
                    confined(parameter.value, self._node.get_parameter('files.root').value)
                except SettingsError as error:
                    return SetParametersResult(
                        successful=False, reason=f'{parameter.name}: {error}'
                    )
            choices = CHOSEN[parameter.name].choices if parameter.name in CHOSEN else ()
            if choices and parameter.value not in choices:
                return SetParametersResult(
                    successful=False,
                    reason=f'{parameter.name} must be one of {", ".join(choices)}; '
                    f'got {parameter.value!r}',
                )
        return SetParametersResult(successful=True)

    def _meant(self, changed: list[Parameter]) -> list[Parameter]:
        """Return the parameters to set, including all those of a preset among them.

        Explicit values override the preset's; all are accepted together, or none.
        """
        changed = [self._modern(self._double(parameter)) for parameter in changed]
        given = {parameter.name: parameter.value for parameter in changed}
        if (name := given.get('design.preset')) not in tuple(PRESETS):
            return changed
        chosen = groups(preset(name))
        brought = {
            f'{prefix}.{field.name}': getattr(chosen[prefix], field.name)
            for prefix in OF_A_PRESET
            for field, _ in descriptions(chosen[prefix])
        }
        return [
            *changed,
            *(Parameter(key, value=value) for key, value in brought.items() if key not in given),
        ]

    def _double(self, parameter: Parameter) -> Parameter:
        """Return a parameter with an integer converted to a double if a double is declared."""
        known = self._node.has_parameter(parameter.name)
        meant = known and isinstance(self._node.get_parameter(parameter.name).value, float)
        if meant and parameter.type_ == Parameter.Type.INTEGER:
            return Parameter(parameter.name, value=float(parameter.value))
        return parameter

    def _modern(self, parameter: Parameter) -> Parameter:
        """Return a parameter with today's wording."""
        old = parameter.value is False or parameter.value == WAS_SKIP
        if parameter.name != 'design.check' or not old:
            return parameter
        self._node.get_logger().warning(
            f'design.check: off is now called {SKIP} (YAML reads off as false)'
        )
        return Parameter('design.check', value=SKIP)


def _warn_of_strangers(node: Node) -> None:
    """Warn of given parameters that do not exist, such as misspelt ones."""
    known = sorted(node.list_parameters([], 0).names)
    for name in sorted(node._parameter_overrides):  # rclpy has no public way to ask
        if name in known or name.startswith('qos_overrides.'):
            continue
        alike = difflib.get_close_matches(name, known, 1)
        hint = f'; did you mean {alike[0]}?' if alike else ''
        node.get_logger().warning(f'there is no parameter {name}: it is ignored{hint}')


def _declare(node: Node, name: str, default: Any, description: Description) -> Any:
    try:
        return node.declare_parameter(name, default, descriptor(description, default)).value
    except InvalidParameterTypeException as error:
        hint = ' (a number with a decimal point)' if isinstance(default, float) else ''
        raise ParameterError(
            f'parameter {name} must be {_article(default)}{hint}; got {_given(node, name)}'
        ) from error
    except InvalidParameterValueException as error:
        raise ParameterError(
            f'parameter {name} must be from {description.low} to {description.high}; '
            f'got {_given(node, name)}'
        ) from error


def descriptor(description: Description, default: Any) -> ParameterDescriptor:
    """Return the ROS descriptor of a described field.

    Args:
        description: Meaning, unit and range.
        default: The default value: its type is the parameter's.
    """
    text = description.text + (f' [{description.unit}]' if description.unit else '')
    result = ParameterDescriptor(description=text)
    if description.choices:
        result.additional_constraints = f'one of {", ".join(description.choices)}'
    low, high = description.low, description.high
    if low is None and high is None:
        return result
    if isinstance(default, float):
        limit = sys.float_info.max
        result.floating_point_range = [
            FloatingPointRange(
                from_value=float(-limit if low is None else low),
                to_value=float(limit if high is None else high),
            )
        ]
    else:
        result.integer_range = [
            IntegerRange(
                from_value=-(2**63) if low is None else int(low),
                to_value=2**63 - 1 if high is None else int(high),
                step=1,
            )
        ]
    return result


def _article(default: Any) -> str:
    names = {bool: 'a bool', int: 'an integer', float: 'a double', str: 'a string'}
    return names[type(default)]


def _given(node: Node, name: str) -> str:
    override = node._parameter_overrides.get(name)  # rclpy has no public way to ask
    return repr(override.value) if override is not None else 'something else'
