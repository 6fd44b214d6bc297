# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's parameters, declared from the descriptions of the settings that they fill."""

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

from ...clipped import clipped
from ...described import Description, descriptions
from ...device import PRESETS, Refused, SettingsError, drivers, preset
from ...device.settings import Settings
from ...host import Host
from ...host.files import confined
from ...host.settings import Parameters
from ...physics import DesignError
from .declarations import LIVE, OF_A_PRESET, OF_THE_NODE, declarations, groups

ARTICLES = {bool: 'a bool', int: 'an integer', float: 'a double', str: 'a string'}
"""The types of parameters, for messages."""

FAULTS = 'faults.'
"""Prefix of the device's faults, which take effect at once."""

LIVE_GROUPS = ('record', 'faults')
"""Groups that may be set at any time: one applies to the next session, one to the device."""

PACE = 'record.hash_every'
"""Of these groups, but the running loop counts on it."""

PATHS = ('record.path', 'state.path')
"""Parameters that make the node write files."""


class ParameterSet:
    """Declares all parameters of the contract, validates them, and puts changes into effect."""

    def __init__(self, node: Node, host: Host) -> None:
        """Declare all parameters.

        Raises:
            SettingsError: A parameter has the wrong type or is out of range, or the values do not
                make a memory or contradict each other.
        """
        self._node = node
        self._host = host
        self._choices: dict[str, tuple[str, ...]] = {}
        self.locked = False
        """Whether the node is configured, so that only live parameters may be set."""
        chosen = preset(self._declare('design.preset', *OF_THE_NODE['design.preset']))
        self._defaults = groups(chosen)
        own = {'publish.frame_id': node.get_fully_qualified_name()[1:]}
        for name, default, description in declarations(chosen):
            if name != 'design.preset':
                self._declare(name, own.get(name, default), description)
        started = node.get_parameter('device.driver').value  # no client can import other classes
        allowed = dict.fromkeys((drivers.SIMULATION, *drivers.SHIPPED, started))
        self._choices['device.driver'] = tuple(allowed)
        _warn_of_strangers(node)
        self._limit_level(self.values().design.levels)
        node.add_pre_set_parameters_callback(self._meant)  # with two, rclpy would use both answers
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def values(self) -> Parameters:
        """Return the present values.

        Raises:
            SettingsError: They do not make a memory, or contradict each other.
        """
        given = {prefix: self._group(prefix) for prefix in self._defaults}
        own = ('device', 'design', 'publish', 'record', 'state', 'files', 'faults')
        parts = {name: given.pop(name) for name in own}
        check = self._node.get_parameter('design.check').value
        return Parameters(check=check, settings=Settings(**given), **parts)

    def lock(self, levels: int) -> None:
        """Allow only live parameters from now on, and levels below `levels`."""
        self._limit_level(levels)
        self.locked = True

    def _declare(self, name: str, default: Any, description: Description) -> Any:
        """Declare a parameter; return its value."""
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
            self._choices[name] = description.choices
            if why := self._not_a_choice(name, value.value):
                raise SettingsError(f'parameter {why}')
        return value.value

    def _raw(self, name: str) -> str:
        override = self._node._parameter_overrides.get(name)  # rclpy has no public way to ask
        return repr(override.value) if override is not None else 'something else'

    def _group(self, prefix: str, **changed: Any) -> Any:
        """Return a group of settings, with changes.

        Raises:
            SettingsError: Ranges alone do not make it valid.
        """
        defaults = self._defaults[prefix]
        values = {
            field.name: self._node.get_parameter(f'{prefix}.{field.name}').value
            for field, _ in descriptions(defaults)
        }
        try:
            return type(defaults)(**values | changed)
        except (DesignError, SettingsError) as error:
            raise SettingsError(f'parameters {prefix}.*: {error}') from error

    def _limit_level(self, levels: int) -> None:
        """Give `target_level` the range of the design."""
        default, description = LIVE['target_level']
        limited = dataclasses.replace(description, high=max(0, levels - 1))
        present = self._node.get_parameter('target_level').value
        if not 0 <= present < max(1, levels):
            raise SettingsError(
                f'parameter target_level must be from 0 to {levels - 1}; got {present}'
            )
        described = descriptor(limited, default)
        described.type = ParameterType.PARAMETER_INTEGER
        self._node.set_descriptor('target_level', described)

    def _check(self, changed: list[Parameter]) -> SetParametersResult:
        try:
            for parameter in changed:
                self._check_one(parameter.name, parameter.value)
            faults = {p.name.removeprefix(FAULTS): p.value for p in changed if _is_fault(p)}
            if faults and self._host.element is not None:
                self._host.element.specimen(self._group('faults', **faults))
        except (Refused, SettingsError) as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _check_one(self, name: str, value: Any) -> None:
        """Refuse a value that may not be set now.

        Raises:
            SettingsError: It may not.
        """
        live = name in LIVE or name.split('.')[0] in LIVE_GROUPS
        if name == 'use_sim_time':
            if self._host.loop is not None:
                raise SettingsError(f'{name} may be set only while the node is not active')
        elif self.locked and (not live or name == PACE):
            raise SettingsError(f'{name} may be set only while the node is unconfigured')
        if name == 'files.root':
            raise SettingsError(f'{name} may be set only at the start of the node')
        if name in PATHS and value:
            try:
                confined(value, self._node.get_parameter('files.root').value)
            except SettingsError as error:
                raise SettingsError(f'{name}: {error}') from error
        if why := self._not_a_choice(name, value):
            hint = '; a class may be named only at the start' if name == 'device.driver' else ''
            raise SettingsError(why + hint)

    def _not_a_choice(self, name: str, value: Any) -> str:
        choices = self._choices.get(name)
        if choices is None or value in choices:
            return ''
        return f'{name} must be one of {", ".join(choices)}; got {clipped(value)}'

    def _apply(self, changed: list[Parameter]) -> None:
        """Put changes into effect while time runs."""
        with self._host.journal.guarded('parameters'):
            if any(map(_is_fault, changed)):
                self._host.be_faulty(self._group('faults'))
            for parameter in changed:
                if parameter.name == 'time.speed':
                    self._host.set_speed(parameter.value)

    def _meant(self, changed: list[Parameter]) -> list[Parameter]:
        """Return the parameters to set, including all those of a preset among them.

        Explicit values override the preset's; all are accepted together, or none.
        """
        changed = [self._double(parameter) for parameter in changed]
        given = {parameter.name: parameter.value for parameter in changed}
        if (name := given.get('design.preset')) not in tuple(PRESETS):
            return changed
        others = {*given, *OF_THE_NODE, *LIVE}
        return [
            *changed,
            *(
                Parameter(key, value=value)
                for key, value, _ in declarations(preset(name))
                if key.split('.')[0] in OF_A_PRESET and key not in others
            ),
        ]

    def _double(self, parameter: Parameter) -> Parameter:
        """Return a parameter with an integer converted to a double if a double is declared."""
        known = self._node.has_parameter(parameter.name)
        meant = known and isinstance(self._node.get_parameter(parameter.name).value, float)
        if meant and parameter.type_ == Parameter.Type.INTEGER:
            return Parameter(parameter.name, value=float(parameter.value))
        return parameter


def _is_fault(parameter: Parameter) -> bool:
    name: str = parameter.name
    return name.startswith(FAULTS)


def _warn_of_strangers(node: Node) -> None:
    """Warn of given parameters that do not exist, such as misspelt ones."""
    known = sorted(node.list_parameters([], 0).names)
    for name in sorted(node._parameter_overrides):  # rclpy has no public way to ask
        if name in known or name.startswith('qos_overrides.'):
            continue
        alike = difflib.get_close_matches(name, known, 1)
        hint = f'; did you mean {alike[0]}?' if alike else ''
        node.get_logger().warning(f'there is no parameter {name}: it is ignored{hint}')


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
