# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's parameters: what they say of the element, which changes are taken, what these do."""

from __future__ import annotations

import dataclasses
from contextlib import suppress
from typing import Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_system_default
from rclpy.service_introspection import ServiceIntrospectionState

from mlmem import Refused, SettingsError, load_element
from mlmem.element_file import ELEMENT_NAMES, Element, ElementFileError, text_of
from mlmem.instrument import drivers
from mlmem.loop.timetable import check_speed
from mlmem.procedure_table import UNSET_CONTENT
from mlmem.readers.words import count_words
from mlmem.schema import find_descriptions, short_repr
from mlmem.settings import Settings

from ...contract.services import NODE_SERVICES
from ...host import Host
from ...host.settings import (
    ACTUATOR,
    ATTEMPTS,
    DESCRIPTION,
    ELEMENT,
    GROUPS,
    INITIAL_CONTENT,
    INTROSPECTION_PARAMETER,
    INTROSPECTION_STATES,
    LIVE_PARAMETERS,
    METHOD,
    READ_END,
    TWIN,
    Parameters,
    declare_parameters,
    with_overrides,
)
from .declared_parameters import CheckedParameters, build_descriptor

FAULTS_PREFIX = 'faults.'
"""Prefix of the device's faults, which take effect at once."""

LIVE_GROUPS = ('record', 'faults')
"""Groups that may be set at any time: one applies to the next session, one to the device."""

QOS_OVERRIDES_PREFIX = 'qos_overrides.'
"""Prefix of the parameters that rclpy declares for an endpoint; they are read-only."""

LEVEL, WORD = 'target_level', 'target_word'
"""What `~/write` writes to an element with one wall, and to a register."""


class ParameterSet:
    """Knows all parameters of the contract, validates them, and puts changes into effect.

    Attributes:
        locked: Whether the node is configured, so that only live parameters may be set.
    """

    def __init__(self, node: CheckedParameters, host: Host) -> None:
        """Declare the parameters.

        Raises:
            SettingsError: A parameter has the wrong type or is out of range, or the values do not
                make a memory or contradict each other.
        """
        self._node = node
        self._host = host
        self.locked = False
        own = {'publish.frame_id': node.get_fully_qualified_name()[1:]}
        node.declare_described(
            (name, own.get(name, default), description)
            for name, default, description in declare_parameters()
        )
        self._element = self._checked = self._load(node.get_value(ELEMENT))
        node.computed_parameters[DESCRIPTION] = self.description
        started = node.get_value('device.driver')  # no client can import other classes
        allowed = dict.fromkeys((drivers.SIMULATION_NAME, *drivers.SHIPPED_DRIVERS, started))
        node.parameter_choices['device.driver'] = tuple(allowed)
        if node.get_value('files.root'):  # nor use other places
            node.parameter_choices['device.address'] = ('', node.get_value('device.address'))
        check_speed(node.get_value('time.speed'))
        self._limit_content(count_words(self._element.design, self.values().settings))
        self._compare_description()
        node.add_pre_set_parameters_callback(self._completed)
        node.add_on_set_parameters_callback(self._check_changes)
        node.add_post_set_parameters_callback(self._apply_changes)

    def values(self) -> Parameters:
        """Return the present values.

        Raises:
            SettingsError: They contradict each other.
        """
        element = self._element
        ideal = element.specimen.is_ideal and element.time_unit == 1.0
        return Parameters(
            design=element.design,
            check=self._node.get_value('design.check'),
            settings=self._overridden(element),
            specimen=None if ideal else element.timed_specimen,
            initial_content=self._node.get_value(INITIAL_CONTENT),
            twin=self._node.get_value(TWIN),
            **{prefix: self._read_group(prefix) for prefix in GROUPS},
        )

    def description(self) -> str:
        """Return the element as the text of an element file."""
        return text_of(self._element)

    def _overridden(self, element: Element, **changed: Any) -> Settings:
        """Return the settings of an element, with the parameters of the node that override some.

        Raises:
            SettingsError: They contradict each other.
        """
        overrides = (METHOD, ATTEMPTS, ACTUATOR, READ_END)  # of the element file's values
        given = {name: self._node.get_value(name) for name in overrides} | changed
        try:
            return with_overrides(element.settings, given)
        except SettingsError as error:
            named = ', '.join(f'{name} = {value}' for name, value in given.items() if value != '')
            raise SettingsError(f'parameters {named}: {error}') from error

    def _load(self, source: str) -> Element:
        """Return a shipped element, or that in a file.

        Raises:
            SettingsError: There is none.
        """
        try:
            return load_element(
                source
                if source in ELEMENT_NAMES
                else self._read_group('files').confine_path(source)
            )
        except (ElementFileError, SettingsError) as error:
            text = str(error)
            named = text if text.startswith(f'{ELEMENT} ') else f'{ELEMENT}: {text}'
            raise SettingsError(named) from error

    def lock(self, words: int) -> None:
        """Allow only live parameters from now on, and contents below `words`."""
        self._limit_content(words)
        self.locked = True

    def _compare_description(self) -> None:
        """Warn if the element is not the one whose parameters were saved, as by a dump."""
        given = self._node._parameter_overrides.get(DESCRIPTION)
        if given is not None and given.value not in ('', self.description()):
            self._node.get_logger().warning(
                f'the element is not the one whose parameters were saved: {DESCRIPTION} follows '
                f'from {ELEMENT}'
            )

    def _read_group(self, prefix: str, **changed: Any) -> Any:
        """Return a group of settings, with changes.

        Raises:
            SettingsError: Ranges alone do not make it valid.
        """
        defaults = GROUPS[prefix]
        values = {
            field.name: self._node.get_value(f'{prefix}.{field.name}')
            for field, _ in find_descriptions(defaults)
        }
        try:
            return type(defaults)(**values | changed)
        except SettingsError as error:
            raise SettingsError(f'parameters {prefix}.*: {error}') from error

    def _limit_content(self, words: int) -> None:
        """Give the target that fits the element its range.

        Raises:
            SettingsError: A target is out of range, or belongs to the other kind of element.
        """
        for name in (LEVEL, WORD):
            default, description = LIVE_PARAMETERS[name]
            if is_fitting_target(name, self._element):
                description = dataclasses.replace(description, high=max(0, words - 1))
                present = self._node.get_value(name)
                if not UNSET_CONTENT <= present < max(1, words):
                    raise SettingsError(
                        f'parameter {name} must be from 0 to {words - 1}; got {present}'
                    )
            else:
                _check_target(name, self._node.get_value(name), self._element)
            described = build_descriptor(description, default)
            described.type = ParameterType.PARAMETER_INTEGER
            self._node.set_descriptor(name, described)

    def _completed(self, changed: list[Parameter]) -> list[Parameter]:
        """Return the parameters to set: doubles as doubles, and the target that does not fit a new
        element as not set.
        """
        changed = [self._convert_double(parameter) for parameter in changed]
        given = {parameter.name: parameter.value for parameter in changed}
        if not isinstance(given.get(ELEMENT), str):  # rclpy refuses another type
            return changed
        try:
            element = self._load(given[ELEMENT])
        except SettingsError:  # `_check_changes` reports it
            return changed
        unfit = LEVEL if is_fitting_target(WORD, element) else WORD
        return changed if unfit in given else [*changed, Parameter(unfit, value=UNSET_CONTENT)]

    def _convert_double(self, parameter: Parameter) -> Parameter:
        """Return a parameter converted to a double if a double is declared, and one is meant.

        An integer is meant; so is the text 5e-05, as `ros2 param load` reads what `dump` wrote.
        """
        known = self._node.has_parameter(parameter.name)
        meant = known and isinstance(self._node.get_value(parameter.name), float)
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
            self._checked = self._load(given[ELEMENT]) if ELEMENT in given else self._element
            for name in given.keys() & {LEVEL, WORD}:
                _check_target(name, given[name], self._checked)
            faults = {p.name.removeprefix(FAULTS_PREFIX): p.value for p in changed if _is_fault(p)}
            if faults and self._host.element is not None:
                self._host.element.specimen(self._read_group('faults', **faults))
            if METHOD in given and self.locked:
                self._overridden(self._checked, **{METHOD: given[METHOD]})
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
            raise SettingsError(f'there is no parameter {short_repr(name)}')
        live = name in (*LIVE_PARAMETERS, METHOD) or name.split('.')[0] in LIVE_GROUPS
        if name == 'use_sim_time':
            if self._host.loop is not None and value != self._node.get_value(name):
                raise SettingsError(f'{name} may be set only while the node is not active')
        elif (
            self.locked
            and (not live or name == 'record.hash_every')  # the running loop counts on it
            and value != self._node.get_value(name)
        ):
            raise SettingsError(f'{name} may be set only while the node is unconfigured')
        if name == 'files.root' and value != self._node.get_value(name):
            raise SettingsError(f'{name} may be set only at the start of the node')
        if name == 'time.speed':
            check_speed(value)
        if name == DESCRIPTION and value != self.description():
            raise SettingsError(f'{name} follows from {ELEMENT}; set that one')
        if name in ('record.path', 'state.path', TWIN) and value:
            try:
                self._read_group('files').confine_path(value)
            except SettingsError as error:
                raise SettingsError(f'{name}: {error}') from error
        if why := self._node.not_a_choice(name, value):
            hint = {
                'device.driver': '; a class may be named only at the start',
                'device.address': '; with files.root it may be named only at the start',
            }
            raise SettingsError(why + hint.get(name, ''))

    def _apply_changes(self, changed: list[Parameter]) -> None:
        """Put changes into effect while time runs."""
        changed = [each for each in changed if not each.name.startswith(QOS_OVERRIDES_PREFIX)]
        if not changed:  # it is declared
            return
        with self._host.log.guard_errors('parameters'):
            given = ', '.join(f'{each.name} = {short_repr(each.value)}' for each in changed)
            self._host.log.info(f'set {given}', 'parameters')
            self._element = self._checked
            if any(map(_is_fault, changed)):
                self._host.set_faults(self._read_group('faults'))
            for parameter in changed:
                if parameter.name == 'time.speed':
                    self._host.set_speed(parameter.value)
                elif parameter.name == METHOD:
                    self._host.set_method(self.values().settings.write.method)
                elif parameter.name == INTROSPECTION_PARAMETER:
                    self.configure_introspection()

    def configure_introspection(self) -> None:
        """Publish what our services are asked and answer, as far as the parameter says."""
        state = getattr(
            ServiceIntrospectionState,
            INTROSPECTION_STATES[self._node.get_value(INTROSPECTION_PARAMETER)],
        )
        own = {
            service.name for service in NODE_SERVICES
        }  # rcl's, of the life cycle, have no types
        for service in self._node.services:
            if service.srv_name.rpartition('/')[2] in own:
                service.configure_introspection(
                    self._node.get_clock(), qos_profile_system_default, state
                )


def is_fitting_target(name: str, element: Element) -> bool:
    """Return whether `LEVEL` or `WORD` belongs to an element."""
    return (name == WORD) == (element.settings.register.spacing > 0)


def _check_target(name: str, value: int, element: Element) -> None:
    """Raise `SettingsError` if a target is set that belongs to the other kind of element."""
    if value != UNSET_CONTENT and not is_fitting_target(name, element):
        one_wall = name == WORD
        kind, other = ('an element with one wall', LEVEL) if one_wall else ('a register', WORD)
        raise SettingsError(
            f'{name} must be {UNSET_CONTENT} (not set) for {kind}, which takes {other}; got '
            f'{value}'
        )


def _is_fault(parameter: Parameter) -> bool:
    name: str = parameter.name
    return name.startswith(FAULTS_PREFIX)
