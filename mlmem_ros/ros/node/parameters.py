# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's parameters: what they say of the element, which changes are taken, what these do."""

from __future__ import annotations

import dataclasses
import difflib
import sys
from contextlib import suppress
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
from rclpy.qos import qos_profile_system_default
from rclpy.service_introspection import ServiceIntrospectionState

from mlmem import (
    SHIPPED_DRIVERS,
    SIMULATION_NAME,
    ErrorCode,
    Refused,
    Settings,
    SettingsError,
    check_speed,
    count_words,
    load_element,
)
from mlmem.element_file import ELEMENT_NAMES, Element, text_of
from mlmem.procedure_table import CONTENT_NAMES, PROCEDURES, UNSET_CONTENT
from mlmem.schema import Description, describe_choices, find_descriptions, short_repr

from ...contract.requests import NODE_SERVICES
from ...host import Host
from ...host.settings import (
    DESCRIPTION,
    ELEMENT_OVERRIDES,
    GROUPS,
    LIVE_PARAMETERS,
    Parameters,
    declare_parameters,
    name_rejections,
)

QOS_OVERRIDES_PREFIX = 'qos_overrides.'
"""Prefix of the parameters that rclpy declares for an endpoint; they are read-only."""

TARGETS = PROCEDURES['write'].target_parameters
"""Parameters with what `~/write` writes: `target_level` and `target_word`, by what they hold."""


class ParameterSet:
    """Knows all parameters of the contract, validates them, and puts changes into effect.

    Attributes:
        locked: Whether the node is configured, so that only live parameters may be set.
    """

    def __init__(self, node: Node, host: Host) -> None:
        """Declare the parameters; warn of given ones that there are not.

        Raises:
            SettingsError: A parameter has the wrong type or is out of range, or the values do not
                make a memory or contradict each other.
        """
        self._node = node
        self._host = host
        self.locked = False
        self._choices: dict[str, tuple[str, ...]] = {}
        own = {'publish.frame_id': node.get_fully_qualified_name()[1:]}
        declared = {name: each for name, *each in declare_parameters()}
        _, description = declared.pop(DESCRIPTION)
        for name, (default, described) in declared.items():
            self._declare_parameter(name, own.get(name, default), described)
        self._element = self._checked = self._load_source(self._get_value('element'))
        text = text_of(self._element)
        node.declare_parameter(DESCRIPTION, text, build_descriptor(description, ''), True)
        self._report_strange_overrides(text)
        started = self._get_value('device.driver')  # no client can import other classes
        allowed = dict.fromkeys((SIMULATION_NAME, *SHIPPED_DRIVERS, started))
        self._choices['device.driver'] = tuple(allowed)
        if self._get_value('files.root'):  # nor use other places
            self._choices['device.address'] = ('', self._get_value('device.address'))
        check_speed(self._get_value('time.speed'))
        self._check_targets()
        node.add_pre_set_parameters_callback(self._complete_changes)
        node.add_on_set_parameters_callback(self._check_changes)
        node.add_post_set_parameters_callback(self._apply_changes)

    def _declare_parameter(self, name: str, default: Any, description: Description) -> None:
        """Declare a parameter.

        Raises:
            SettingsError: The given one has the wrong type or is out of range.
        """
        given = self._node._parameter_overrides.get(name)
        value = given.value if given else default
        try:
            self._node.declare_parameter(name, default, build_descriptor(description, default))
        except InvalidParameterTypeException as error:
            hint = ' (a number with a decimal point)' if isinstance(default, float) else ''
            names = {bool: 'a bool', int: 'an integer', float: 'a double', str: 'a string'}
            expected = f'{names[type(default)]}{hint}'
            raise SettingsError.out_of_range(name, value, expected) from error
        except InvalidParameterValueException as error:
            expected = f'from {description.low} to {description.high}'
            raise SettingsError.out_of_range(name, value, expected) from error
        if description.choices:
            self._choices[name] = description.choices
            self._check_choice(name, self._get_value(name))

    def _report_strange_overrides(self, description: str) -> None:
        """Warn of given parameters that there are not, and if the element is not the one whose
        parameters were saved, as by a dump.
        """
        log, given = self._host.log, self._node._parameter_overrides
        for name in sorted(given):
            if not (self._node.has_parameter(name) or name.startswith(QOS_OVERRIDES_PREFIX)):
                log.warning(
                    f'there is no parameter {name}: it is ignored{self._suggest_name(name)}'
                )
        if DESCRIPTION in given and given[DESCRIPTION].value not in ('', description):
            log.warning(
                f'the element is not the one whose parameters were saved: {DESCRIPTION} follows '
                'from element'
            )

    def _suggest_name(self, name: str) -> str:
        """Return which parameter has a name like this one."""
        known = sorted(self._node.get_parameters_by_prefix(''))
        alike = difflib.get_close_matches(name, known, 1)
        return f'; did you mean {alike[0]}?' if alike else ''

    def check_names(self, changed: list[Parameter]) -> None:
        """Raise `ParameterNotDeclaredException` with the name of one that there is not."""
        for name in (parameter.name for parameter in changed):
            if name and not self._node.has_parameter(name):  # `_check_change` refuses an empty one
                raise ParameterNotDeclaredException(short_repr(name) + self._suggest_name(name))

    def _get_value(self, name: str) -> Any:
        """Return the present value of a parameter."""
        return self._node.get_parameter(name).value

    def values(self) -> Parameters:
        """Return the present values.

        Raises:
            SettingsError: They contradict each other.
        """
        element = self._element
        ideal = element.specimen.is_ideal and element.time_unit == 1.0
        return Parameters(
            design=element.design,
            check=self._get_value('design.check'),
            settings=self._apply_overrides(element),
            specimen=None if ideal else element.timed_specimen,
            initial_content=self._get_value('initial_content'),
            twin=self._get_value('twin'),
            **{prefix: self._read_group(prefix) for prefix in GROUPS},
        )

    def _apply_overrides(self, element: Element, **changed: Any) -> Settings:
        """Return the settings of an element, with the parameters of the node that override some.

        Raises:
            SettingsError: They contradict each other.
        """
        given = {name: self._get_value(name) for name in ELEMENT_OVERRIDES} | changed
        given = {key: each for key, each in given.items() if each != ELEMENT_OVERRIDES[key][0]}
        groups: dict[str, dict[str, Any]] = {}
        for name, value in given.items():
            group, _, field = name.partition('.')
            groups.setdefault(group, {})[field] = value
        settings = element.settings
        named = ', '.join(f'{name} = {value}' for name, value in given.items() if value != '')
        with name_rejections(f'parameters {named}'):
            return dataclasses.replace(
                settings,
                **{
                    group: dataclasses.replace(getattr(settings, group), **values)
                    for group, values in groups.items()
                },
            )

    def _load_source(self, source: str) -> Element:
        """Return a shipped element, or that in a file.

        Raises:
            SettingsError: There is none.
        """
        with name_rejections('element'):
            is_shipped = source in ELEMENT_NAMES
            return load_element(
                source if is_shipped else self._read_group('files').confine_path(source)
            )

    def lock_parameters(self) -> None:
        """Allow only live parameters from now on.

        Raises:
            SettingsError: A target is none of the contents of the element.
        """
        self._check_targets()
        self.locked = True

    def _read_group(self, prefix: str, **changed: Any) -> Any:
        """Return a group of settings, with changes.

        Raises:
            SettingsError: Ranges alone do not make it valid.
        """
        defaults = GROUPS[prefix]
        values = {
            field.name: self._get_value(f'{prefix}.{field.name}')
            for field, _ in find_descriptions(defaults)
        }
        with name_rejections(owner=prefix):
            return type(defaults)(**values | changed)

    def _check_targets(self) -> None:
        for name in TARGETS.values():
            self._check_target(name, self._get_value(name), self._element)

    def _check_target(self, name: str, value: int, element: Element) -> None:
        """Raise `SettingsError` if a target is set that is none of the contents of an element."""
        if value == UNSET_CONTENT:
            return
        if name != (fitting := TARGETS[CONTENT_NAMES[element.settings.holds_words]]):
            expected = f'{UNSET_CONTENT} (not set) for an element that takes {fitting}'
            raise SettingsError(ErrorCode.UNSUPPORTED, name, value, expected)
        words = count_words(element.design, self._apply_overrides(element))
        if not 0 <= value < words:
            raise SettingsError.out_of_range(name, value, f'from 0 to {words - 1}')

    def _complete_changes(self, changed: list[Parameter]) -> list[Parameter]:
        """Return the parameters to set: doubles as doubles, and with a new element its text, and
        as not set the target that does not fit it.
        """
        changed = [self._convert_double(parameter) for parameter in changed]
        given = {parameter.name: parameter.value for parameter in changed}
        if not isinstance(given.get('element'), str):  # rclpy refuses another type
            return changed
        try:
            element = self._load_source(given['element'])
        except SettingsError:  # `_check_changes` reports it
            return changed
        following: dict[str, Any] = dict.fromkeys(TARGETS.values(), UNSET_CONTENT)
        del following[TARGETS[CONTENT_NAMES[element.settings.holds_words]]]
        following[DESCRIPTION] = text_of(element)
        return changed + [
            Parameter(name, value=value) for name, value in following.items() if name not in given
        ]

    def _convert_double(self, parameter: Parameter) -> Parameter:
        """Return a parameter converted to a double if a double is declared, and one is meant.

        An integer is meant; so is the text 5e-05, as `ros2 param load` reads what `dump` wrote.
        """
        known = self._node.has_parameter(parameter.name)
        meant = known and isinstance(self._get_value(parameter.name), float)
        if meant and parameter.type_ == Parameter.Type.INTEGER:
            return Parameter(parameter.name, value=float(parameter.value))
        if meant and parameter.type_ == Parameter.Type.STRING:
            with suppress(ValueError):
                return Parameter(parameter.name, value=float(parameter.value))
        return parameter

    def _check_changes(self, changed: list[Parameter]) -> SetParametersResult:
        changed = [each for each in changed if not each.name.startswith(QOS_OVERRIDES_PREFIX)]
        try:
            for parameter in changed:
                self._check_change(parameter.name, parameter.value)
            given = {parameter.name: parameter.value for parameter in changed}
            self._checked = (
                self._load_source(given['element']) if 'element' in given else self._element
            )
            for name in given.keys() & TARGETS.values():
                self._check_target(name, given[name], self._checked)
            if DESCRIPTION in given and given[DESCRIPTION] != text_of(self._checked):
                why = 'it follows from element; set that one'
                raise SettingsError(ErrorCode.CONFLICT, DESCRIPTION, reason=why)
            faults = {p.name.removeprefix('faults.'): p.value for p in changed if _is_fault(p)}
            if faults and self._host.element is not None:
                self._host.element.specimen(self._read_group('faults', **faults))
            if 'write.method' in given and self.locked:
                self._apply_overrides(self._checked, **{'write.method': given['write.method']})
        except (Refused, SettingsError) as error:
            self._host.log.refused('a parameter', error)
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _check_change(self, name: str, value: Any) -> None:
        """Refuse a value that may not be set now.

        Raises:
            SettingsError: It may not.
        """
        if not self._node.has_parameter(name):  # rclpy takes an empty name for a declared one
            raise SettingsError(ErrorCode.UNKNOWN_FIELD, reason=f'there is no {short_repr(name)}')
        own = (*LIVE_PARAMETERS, 'write.method', 'use_sim_time')
        live = name in own or name.partition('.')[0] in ('record', 'faults')
        changes = value != self._get_value(name)
        if changes and name == 'use_sim_time' and self._host.loop is not None:
            raise SettingsError(field=name, reason='set it only while the node is not active')
        # the running loop counts on when hashes are due
        if changes and self.locked and (not live or name == 'record.hash_every'):
            raise SettingsError(field=name, reason='set it only while the node is unconfigured')
        if changes and name == 'files.root':
            raise SettingsError(field=name, reason='set it only at the start of the node')
        if name == 'time.speed':
            check_speed(value)
        if name in ('record.path', 'state.path', 'twin') and value:
            with name_rejections(name):
                self._read_group('files').confine_path(value)
        self._check_choice(name, value)

    def _check_choice(self, name: str, value: Any) -> None:
        """Raise `SettingsError` if a value is none of the words that may be set."""
        choices = self._choices.get(name, (value,))
        if value not in choices:
            hints = {  # of those whose choices follow from the start
                'device.driver': ' (a class may be named only at the start)',
                'device.address': ' (with files.root it may be named only at the start)',
            }
            expected = f'{describe_choices(choices)}{hints.get(name, "")}'
            raise SettingsError.out_of_range(name, value, expected)

    def _apply_changes(self, changed: list[Parameter]) -> None:
        """Put changes into effect while time runs."""
        changed = [each for each in changed if not each.name.startswith(QOS_OVERRIDES_PREFIX)]
        if not changed:  # it is declared
            return
        with self._host.log.guard_errors('parameters'):
            given = ', '.join(
                f'{each.name} = {short_repr(each.value)}'
                for each in changed
                if each.name != DESCRIPTION
            )
            self._host.log.info(f'set {given}', 'parameters')
            self._element = self._checked
            if any(map(_is_fault, changed)):
                self._host.set_faults(self._read_group('faults'))
            for parameter in changed:
                if parameter.name == 'time.speed':
                    self._host.set_speed(parameter.value)
                elif parameter.name == 'write.method':
                    self._host.set_method(self.values().settings.write.method)
                elif parameter.name == 'service_configure_introspection':
                    self.configure_introspection()

    def configure_introspection(self) -> None:
        """Publish what our services are asked and answer, as far as the parameter says."""
        value = self._get_value('service_configure_introspection')
        name = 'OFF' if value == 'disabled' else value.upper()
        state = getattr(ServiceIntrospectionState, name)
        own = [service.name for service in NODE_SERVICES]
        for service in self._node.services:
            if service.srv_name.rpartition('/')[2] in own:  # rcl's have no types
                service.configure_introspection(
                    self._node.get_clock(), qos_profile_system_default, state
                )


def _is_fault(parameter: Parameter) -> bool:
    name: str = parameter.name
    return name.startswith('faults.')


def build_descriptor(description: Description, default: Any) -> ParameterDescriptor:
    """Return the ROS descriptor of a described field, whose type is that of the default."""
    text = description.text + (f' [{description.unit}]' if description.unit else '')
    result = ParameterDescriptor(description=text)
    if description.choices:
        result.additional_constraints = describe_choices(description.choices)
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
