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

from mlmem import PRESETS, Preset, Refused, SettingsError, preset
from mlmem.instrument import drivers
from mlmem.loop.timetable import check_speed
from mlmem.parsing import DecodeError
from mlmem.physics import DesignError
from mlmem.physics.curve import Curve
from mlmem.procedure_table import UNSET_CONTENT
from mlmem.schema import find_descriptions, short_repr
from mlmem.settings import Settings

from ...contract.services import NODE_SERVICES
from ...host import Host
from ...host.settings import (
    DIGEST_PARAMETER,
    INTROSPECTION_PARAMETER,
    INTROSPECTION_STATES,
    LAW_PARAMETER,
    LIVE_PARAMETERS,
    NODE_PARAMETERS,
    PRESET_GROUPS,
    Parameters,
    declare_parameters,
    default_groups,
)
from .declared_parameters import CheckedParameters, DeclaredParameters, build_descriptor

FAULTS_PREFIX = 'faults.'
"""Prefix of the device's faults, which take effect at once."""

LIVE_GROUPS = ('record', 'faults')
"""Groups that may be set at any time: one applies to the next session, one to the device."""

METHOD_PARAMETER = 'write.method'
"""How a level is written: may be set at any time, too."""

QOS_OVERRIDES_PREFIX = 'qos_overrides.'
"""Prefix of the parameters that rclpy declares for an endpoint; they are read-only."""

HASH_INTERVAL_PARAMETER = 'record.hash_every'
"""Of these groups, but the running loop counts on it."""

LEVEL, WORD = 'target_level', 'target_word'
"""What `~/write` writes to an element with one wall, and to a register."""

SPACING_PARAMETER = 'register.spacing'
"""Of an element with one wall it is 0."""

PRESET, FILE = 'design.preset', 'design.file'
"""What brings an element."""

PATH_PARAMETERS = ('record.path', 'state.path', 'device.specimen', 'device.twin')
"""Parameters that name files of the node."""


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
        self._known = known = DeclaredParameters(node)
        self._asked = set[str]()  # by name, in the request under way
        self.locked = False
        first = self._load_first_preset()
        self._defaults = default_groups(first)
        own = {'publish.frame_id': node.get_fully_qualified_name()[1:]}
        known.declare_all(
            (name, own.get(name, default), description)
            for name, default, description in declare_parameters(first)
        )
        known.computed[DIGEST_PARAMETER] = self.digest
        started = known.value('device.driver')  # no client can import other classes
        allowed = dict.fromkeys((drivers.SIMULATION_NAME, *drivers.SHIPPED_DRIVERS, started))
        known.choices['device.driver'] = tuple(allowed)
        if known.value('files.root'):  # nor use other places
            known.choices['device.address'] = ('', known.value('device.address'))
        if (law := self._read_law_text(given := known.value(LAW_PARAMETER))) != given:
            node.set_parameters([Parameter(LAW_PARAMETER, value=law)])
        check_speed(known.value('time.speed'))
        present = self.values()
        words = present.design.levels
        if present.settings.register.spacing:
            from mlmem.readers.words import count_words  # few elements hold many walls

            words = count_words(present.design, present.settings)
        self._limit_content(words)
        self._compare_digest()
        node.known = known
        node.add_pre_set_parameters_callback(
            self._expand_preset
        )  # with two, rclpy would use both answers
        node.add_on_set_parameters_callback(self._check_changes)
        node.add_post_set_parameters_callback(self._apply_changes)

    def values(self) -> Parameters:
        """Return the present values.

        Raises:
            SettingsError: They do not make a memory, or contradict each other.
        """
        given = {prefix: self._read_group(prefix) for prefix in self._defaults}
        own = ('device', 'design', 'publish', 'record', 'state', 'files', 'queue', 'faults')
        parts = {name: given.pop(name) for name in own}
        check = self._node.get_parameter('design.check').value
        return Parameters(check=check, settings=Settings(**given), **parts)

    def digest(self) -> str:
        """Return the hash of design and settings; empty if they contradict each other."""
        try:
            values = self.values()
        except (DesignError, SettingsError):
            return ''
        return Preset(values.design, values.settings).digest

    def lock(self, words: int) -> None:
        """Allow only live parameters from now on, and contents below `words`."""
        self._limit_content(words)
        self.locked = True

    def _load_first_preset(self) -> Preset:
        """Return the element that a node starts with, from a file or a preset."""
        first, described = NODE_PARAMETERS[PRESET]
        if not (file := self._known.declare(FILE, *NODE_PARAMETERS[FILE])):
            return preset(self._known.declare(PRESET, first, described))
        from ... import parameter_file  # most nodes have none

        try:
            basis, chosen = parameter_file.read_preset_name(file), parameter_file.load_preset(file)
        except parameter_file.ParameterFileError as error:
            raise SettingsError(f'parameter {FILE}: {error}') from error
        if (given := self._known.declare(PRESET, basis, described)) != basis:
            raise SettingsError(
                f'parameter {PRESET} must be that of {FILE}, {basis}, or not be given; got {given}'
            )
        return chosen

    def _compare_digest(self) -> None:
        """Warn if a file that names a digest, as a dump does, is no longer of this element."""
        given = self._known.given.get(DIGEST_PARAMETER)
        if given is not None and given.value not in ('', present := self.digest()):
            self._node.get_logger().warning(
                f'the element is not the one whose parameters were saved: its design and settings '
                f'have the digest {present}, not {short_repr(given.value)}'
            )

    def _read_group(self, prefix: str, **changed: Any) -> Any:
        """Return a group of settings, with changes.

        Raises:
            SettingsError: Ranges alone do not make it valid.
        """
        defaults = self._defaults[prefix]
        values = {
            field.name: self._known.value(f'{prefix}.{field.name}')
            for field, _ in find_descriptions(defaults)
        }
        if prefix == 'design':
            values['law'] = self._read_law()
        try:
            group = type(defaults)(**values | changed)
            if prefix == 'design':
                group.require_memory()
            return group
        except (DesignError, SettingsError) as error:
            raise SettingsError(f'parameters {prefix}.*: {error}') from error

    def _read_law(self) -> Curve | None:
        """Return the on-site law in cells; None for the paper's.

        Raises:
            SettingsError: Not one in the present units.
        """
        if not (text := self._known.value(LAW_PARAMETER)):
            return None
        from mlmem.law_file import parse_curve  # most elements have the paper's

        try:
            return parse_curve(text, *map(self._known.value, ('scale.length', 'scale.stiffness')))
        except DecodeError as error:
            raise SettingsError(f'{LAW_PARAMETER}: {error}') from error

    def _read_law_text(self, source: str) -> str:
        """Return the text of a law, given it or the path of its file; nothing for nothing.

        Raises:
            SettingsError: There is no such file, or it holds none.
        """
        if not source:
            return source
        from mlmem.law_file import is_law_text, parse_curve, read_law_text

        try:
            if not is_law_text(source):
                return read_law_text(self._read_group('files').confine_path(source))
            parse_curve(source)
        except (DecodeError, SettingsError) as error:
            raise SettingsError(f'{LAW_PARAMETER}: {error}') from error
        return source

    def _limit_content(self, words: int) -> None:
        """Give the target that fits the element its range.

        Raises:
            SettingsError: A target is out of range, or belongs to the other kind of element.
        """
        spacing = self._known.value(SPACING_PARAMETER)
        for name in (LEVEL, WORD):
            default, description = LIVE_PARAMETERS[name]
            if is_fitting_target(name, spacing):
                description = dataclasses.replace(description, high=max(0, words - 1))
                present = self._known.value(name)
                if not UNSET_CONTENT <= present < max(1, words):
                    raise SettingsError(
                        f'parameter {name} must be from 0 to {words - 1}; got {present}'
                    )
            else:
                _check_target(name, self._known.value(name), spacing)
            described = build_descriptor(description, default)
            described.type = ParameterType.PARAMETER_INTEGER
            self._node.set_descriptor(name, described)

    def _expand_preset(self, changed: list[Parameter]) -> list[Parameter]:
        """Return the parameters to set, including all those of a preset among them.

        Explicit values override the preset's; all are accepted together, or none. A file goes on
        to bring the element until it is left for nothing or for another preset than its own.
        """
        changed = [self._read_law_file(self._convert_double(parameter)) for parameter in changed]
        given = {parameter.name: parameter.value for parameter in changed}
        self._asked = set(given)
        file = self._known.value(FILE)
        leaving = bool(file) and given.get(FILE) == ''
        name = given.get(PRESET, self._known.value(PRESET) if leaving else None)
        same = name == self._known.value(PRESET) and not leaving  # as a dump that is loaded says
        if name not in tuple(PRESETS) or same:
            return changed
        others = {*given, *NODE_PARAMETERS, *LIVE_PARAMETERS}
        spacing = given.get(SPACING_PARAMETER, preset(name).settings.register.spacing)
        unfit = LEVEL if is_fitting_target(WORD, spacing) else WORD
        return [
            *changed,
            Parameter(FILE, value=''),
            *([] if LAW_PARAMETER in given else [Parameter(LAW_PARAMETER, value='')]),
            *([] if unfit in given else [Parameter(unfit, value=UNSET_CONTENT)]),
            *(
                Parameter(key, value=value)
                for key, value, _ in declare_parameters(preset(name))
                if key.split('.')[0] in PRESET_GROUPS and key not in others
            ),
        ]

    def _read_law_file(self, parameter: Parameter) -> Parameter:
        """Return a law whose file is named as its text, which goes where the file does not."""
        if parameter.name == LAW_PARAMETER and isinstance(parameter.value, str):
            with suppress(SettingsError):  # `_check_changes` tells it
                return Parameter(LAW_PARAMETER, value=self._read_law_text(parameter.value))
        return parameter

    def _convert_double(self, parameter: Parameter) -> Parameter:
        """Return a parameter converted to a double if a double is declared, and one is meant.

        An integer is meant; so is the text 5e-05, as `ros2 param load` reads what `dump` wrote.
        """
        known = self._node.has_parameter(parameter.name)
        meant = known and isinstance(self._node.get_parameter(parameter.name).value, float)
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
            spacing = given.get(SPACING_PARAMETER, self._known.value(SPACING_PARAMETER))
            for name in given.keys() & {LEVEL, WORD}:
                _check_target(name, given[name], spacing)
            faults = {p.name.removeprefix(FAULTS_PREFIX): p.value for p in changed if _is_fault(p)}
            if faults and self._host.element is not None:
                self._host.element.specimen(self._read_group('faults', **faults))
            if METHOD_PARAMETER in given and self.locked:
                write = self._read_group('write', method=given[METHOD_PARAMETER])
                dataclasses.replace(self.values().settings, write=write)
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
        live = name in (*LIVE_PARAMETERS, METHOD_PARAMETER) or name.split('.')[0] in LIVE_GROUPS
        if name == 'use_sim_time':
            if self._host.loop is not None and value != self._node.get_parameter(name).value:
                raise SettingsError(f'{name} may be set only while the node is not active')
        elif (
            self.locked
            and (not live or name == HASH_INTERVAL_PARAMETER)
            and value != self._known.value(name)
        ):
            raise SettingsError(f'{name} may be set only while the node is unconfigured')
        if (
            name in ('files.root', FILE)
            and value != self._known.value(name)
            and (name, value) != (FILE, '')
        ):
            raise SettingsError(f'{name} may be set only at the start of the node')
        if name == 'time.speed':
            check_speed(value)
        if name == DIGEST_PARAMETER and value != (digest := self.digest()):
            raise SettingsError(f'{name} is computed: {digest}; got {short_repr(value)}')
        if name == LAW_PARAMETER:
            self._read_law_text(value)
        if name in PATH_PARAMETERS and value:
            try:
                self._read_group('files').confine_path(value)
            except SettingsError as error:
                raise SettingsError(f'{name}: {error}') from error
        if why := self._known.not_a_choice(name, value):
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
            if any(map(_is_fault, changed)):
                self._host.set_faults(self._read_group('faults'))
            for parameter in changed:
                if parameter.name == 'time.speed':
                    self._host.set_speed(parameter.value)
                elif parameter.name == METHOD_PARAMETER:
                    self._host.set_method(parameter.value)
                elif parameter.name == INTROSPECTION_PARAMETER:
                    self.configure_introspection()

    def configure_introspection(self) -> None:
        """Publish what our services are asked and answer, as far as the parameter says."""
        state = getattr(
            ServiceIntrospectionState,
            INTROSPECTION_STATES[self._known.value(INTROSPECTION_PARAMETER)],
        )
        own = {
            service.name for service in NODE_SERVICES
        }  # rcl's, of the life cycle, have no types
        for service in self._node.services:
            if service.srv_name.rpartition('/')[2] in own:
                service.configure_introspection(
                    self._node.get_clock(), qos_profile_system_default, state
                )


def is_fitting_target(name: str, spacing: int) -> bool:
    """Return whether `LEVEL` or `WORD` belongs to an element with a `SPACING_PARAMETER`."""
    return (name == WORD) == (spacing > 0)


def _check_target(name: str, value: int, spacing: int) -> None:
    """Raise `SettingsError` if a target is set that belongs to the other kind of element."""
    if value != UNSET_CONTENT and not is_fitting_target(name, spacing):
        kind, other = ('a register', WORD) if spacing else ('an element with one wall', LEVEL)
        raise SettingsError(
            f'{name} must be {UNSET_CONTENT} (not set) for {kind}, which takes {other}; got '
            f'{value}'
        )


def _is_fault(parameter: Parameter) -> bool:
    name: str = parameter.name
    return name.startswith(FAULTS_PREFIX)
