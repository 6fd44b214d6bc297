# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node's parameters, declared from the descriptions of the settings that they fill.

Those of a preset that a robot leaves alone are not listed: 170 names hide the twenty that a robot
builder changes. By name they are told and set like any; what was set is listed. They are declared
when somebody asks for them, because rclpy takes its time for each.
"""

from __future__ import annotations

import dataclasses
import difflib
import sys
import threading
from contextlib import suppress
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterNotDeclaredException,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from ...clipped import clipped
from ...described import Description, descriptions
from ...device import PRESETS, Preset, Refused, SettingsError, drivers, preset
from ...device.settings import Settings
from ...device.timetable import checked_speed
from ...host import Host
from ...host.settings import Parameters
from ...law_file import LawFileError, curve_of, is_text, text_in
from ...physics import DesignError
from ...physics.curve import Curve
from ...procedures import as_text, from_text
from .declarations import (
    DIGEST,
    LAW,
    LIVE,
    OF_A_PRESET,
    OF_THE_NODE,
    declarations,
    groups,
    is_listed,
)

ARTICLES = {bool: 'a bool', int: 'an integer', float: 'a double', str: 'a string'}
"""The types of parameters, for messages."""

FAULTS = 'faults.'
"""Prefix of the device's faults, which take effect at once."""

LIVE_GROUPS = ('record', 'faults')
"""Groups that may be set at any time: one applies to the next session, one to the device."""

METHOD = 'write.method'
"""How a level is written: may be set at any time, too."""

PACE = 'record.hash_every'
"""Of these groups, but the running loop counts on it."""

LEVEL, WORD = 'target_level', 'target_word'
"""What `~/write` writes: the word unless it is empty."""

PRESET, FILE = 'design.preset', 'design.file'
"""What brings an element."""

PATHS = ('record.path', 'state.path', 'device.specimen', 'device.twin')
"""Parameters that name files of the node."""


class ParameterSet:
    """Knows all parameters of the contract, validates them, and puts changes into effect.

    Attributes:
        hidden: Those that the node does not list.
        locked: Whether the node is configured, so that only live parameters may be set.
    """

    def __init__(self, node: Node, host: Host) -> None:
        """Declare the parameters.

        Raises:
            SettingsError: A parameter has the wrong type or is out of range, or the values do not
                make a memory or contradict each other.
        """
        self._node = node
        self._host = host
        self._given: dict[str, Parameter] = node._parameter_overrides  # no public way to ask
        self._choices: dict[str, tuple[str, ...]] = {}
        self._asked = set[str]()  # by name, in the request under way
        self._undeclared: dict[str, tuple[Any, Description]] = {}  # default and description
        self._declaring: str | None = None  # that which is asked for now
        self._lock = threading.RLock()
        self.locked = False
        self._words = 1
        first = self._first()
        self._defaults = groups(first)
        own = {'publish.frame_id': node.get_fully_qualified_name()[1:]}
        for name, default, description in declarations(first):
            if not (is_listed(name, description) or name in self._given):
                self._undeclared[name] = default, description
            elif not node.has_parameter(name):
                self._declare(name, own.get(name, default), description)
        self.hidden = set(self._undeclared)
        started = node.get_parameter('device.driver').value  # no client can import other classes
        allowed = dict.fromkeys((drivers.SIMULATION, *drivers.SHIPPED, started))
        self._choices['device.driver'] = tuple(allowed)
        if (given := self._value(LAW)) and not is_text(given):
            node.set_parameters([Parameter(LAW, value=self._law_in(given))])
        checked_speed(self._value('time.speed'))
        self._warn_of_strangers()
        present = self.values()
        words = present.design.levels
        if present.settings.register.spacing:
            from ...device.register import words_of  # few elements hold many walls

            words = words_of(present.design, present.settings)
        self._limit_content(words)
        self._compare_digest()
        node.add_pre_set_parameters_callback(self._meant)  # with two, rclpy would use both answers
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def values(self) -> Parameters:
        """Return the present values.

        Raises:
            SettingsError: They do not make a memory, or contradict each other.
        """
        given = {prefix: self._group(prefix) for prefix in self._defaults}
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

    def ask(self, name: str) -> None:
        """Declare a parameter if it is one for which nobody has asked yet."""
        with self._lock:
            if (asked := self._undeclared.pop(name, None)) is not None:
                self._declaring = name
                self._declare(name, *asked)
                self._declaring = None

    def ask_all(self) -> None:
        """Declare all parameters."""
        for name in tuple(self._undeclared):
            self.ask(name)

    def lock(self, words: int) -> None:
        """Allow only live parameters from now on, and contents below `words`."""
        self._limit_content(words)
        self.locked = True

    def _first(self) -> Preset:
        """Return the element that a node starts with, from a file or a preset."""
        file, (first, described) = self._declare(FILE, *OF_THE_NODE[FILE]), OF_THE_NODE[PRESET]
        if not file:
            return preset(self._declare(PRESET, first, described))
        from ... import parameter_file  # most nodes have none

        try:
            basis, chosen = parameter_file.preset_of(file), parameter_file.load(file)
        except parameter_file.ParameterFileError as error:
            raise SettingsError(f'parameter {FILE}: {error}') from error
        if (given := self._declare(PRESET, basis, described)) != basis:
            raise SettingsError(
                f'parameter {PRESET} must be that of {FILE}, {basis}, or not be given; got {given}'
            )
        return chosen

    def _value(self, name: str) -> Any:
        undeclared = self._undeclared.get(name)
        return undeclared[0] if undeclared else self._node.get_parameter(name).value

    def _compare_digest(self) -> None:
        """Warn if a file that names a digest, as a dump does, is no longer of this element."""
        given = self._given.get(DIGEST)
        if given is not None and given.value not in ('', present := self.digest()):
            self._node.get_logger().warning(
                f'the element is not the one whose parameters were saved: its design and settings '
                f'have the digest {present}, not {clipped(given.value)}'
            )

    def _declare(self, name: str, default: Any, description: Description) -> Any:
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
        return repr(self._given[name].value) if name in self._given else 'something else'

    def _group(self, prefix: str, **changed: Any) -> Any:
        """Return a group of settings, with changes.

        Raises:
            SettingsError: Ranges alone do not make it valid.
        """
        defaults = self._defaults[prefix]
        values = {
            field.name: self._value(f'{prefix}.{field.name}')
            for field, _ in descriptions(defaults)
        }
        if prefix == 'design':
            values['law'] = self._law()
        try:
            return type(defaults)(**values | changed)
        except (DesignError, SettingsError) as error:
            raise SettingsError(f'parameters {prefix}.*: {error}') from error

    def _law(self) -> Curve | None:
        """Return the on-site law in cells; None for the paper's.

        Raises:
            SettingsError: Not one in the present units.
        """
        if not (text := self._value(LAW)):
            return None
        try:
            return curve_of(text, *map(self._value, ('scale.length', 'scale.stiffness')))
        except LawFileError as error:
            raise SettingsError(f'{LAW}: {error}') from error

    def _law_in(self, source: str) -> str:
        """Return the text of a law, given it or the path of its file; nothing for nothing.

        Raises:
            SettingsError: There is no such file, or it holds none.
        """
        try:
            if not is_text(source):
                return source and text_in(self._group('files').confined(source))
            curve_of(source)
        except (LawFileError, SettingsError) as error:
            raise SettingsError(f'{LAW}: {error}') from error
        return source

    def _limit_content(self, words: int) -> None:
        """Give `target_level` and `target_word` the range of the design."""
        default, description = LIVE[LEVEL]
        limited = dataclasses.replace(description, high=min(max(0, words - 1), 2**63 - 1))
        present = self._value(LEVEL)
        if not 0 <= present < max(1, words):
            raise SettingsError(f'parameter {LEVEL} must be from 0 to {words - 1}; got {present}')
        self._words = words
        try:
            self._check_word(self._value(WORD))
        except SettingsError as error:
            raise SettingsError(f'parameter {error}') from error
        described = descriptor(limited, default)
        described.type = ParameterType.PARAMETER_INTEGER
        self._node.set_descriptor(LEVEL, described)

    def _check_word(self, text: str) -> None:
        """Raise `SettingsError` unless a text is empty or a content."""
        try:
            if text and not from_text(text) < max(1, self._words):
                last = as_text(self._words - 1)
                raise SettingsError(f'{WORD} must be from 0x0 to {last}; got {clipped(text)}')
        except ValueError as error:
            raise SettingsError(f'{WORD} {error}') from error

    def _check(self, changed: list[Parameter]) -> SetParametersResult:
        if self._is_declared_now(changed):
            return SetParametersResult(successful=True)
        try:
            for parameter in changed:
                self._check_one(parameter.name, parameter.value)
            faults = {p.name.removeprefix(FAULTS): p.value for p in changed if _is_fault(p)}
            if faults and self._host.element is not None:
                self._host.element.specimen(self._group('faults', **faults))
        except (Refused, SettingsError) as error:
            self._host.log.refused('a parameter', error)
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _is_declared_now(self, changed: list[Parameter]) -> bool:
        return [parameter.name for parameter in changed] == [self._declaring]

    def _check_one(self, name: str, value: Any) -> None:
        """Refuse a value that may not be set now.

        Raises:
            SettingsError: It may not.
        """
        if not self._node.has_parameter(name):  # rclpy takes an empty name for a declared one
            raise SettingsError(f'there is no parameter {clipped(name)}')
        live = name in (*LIVE, METHOD) or name.split('.')[0] in LIVE_GROUPS
        if name == 'use_sim_time':
            if self._host.loop is not None:
                raise SettingsError(f'{name} may be set only while the node is not active')
        elif self.locked and (not live or name == PACE) and value != self._value(name):
            raise SettingsError(f'{name} may be set only while the node is unconfigured')
        if (
            name in ('files.root', FILE)
            and value != self._value(name)
            and (name, value) != (FILE, '')
        ):
            raise SettingsError(f'{name} may be set only at the start of the node')
        if name == 'time.speed':
            checked_speed(value)
        if name == WORD:
            self._check_word(value)
        if name == DIGEST and value != (digest := self.digest()):
            raise SettingsError(f'{name} is computed: {digest}; got {clipped(value)}')
        if name == LAW:
            self._law_in(value)
        if name in PATHS and value:
            try:
                self._group('files').confined(value)
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
        if self._is_declared_now(changed):
            return
        self.hidden -= self._asked
        with self._host.log.guarded('parameters'):
            given = ', '.join(f'{each.name} = {clipped(each.value)}' for each in changed)
            self._host.log.info(f'set {given}', 'parameters')
            if any(map(_is_fault, changed)):
                self._host.set_faults(self._group('faults'))
            for parameter in changed:
                if parameter.name == 'time.speed':
                    self._host.set_speed(parameter.value)
                elif parameter.name == METHOD:
                    self._host.set_method(parameter.value)

    def _meant(self, changed: list[Parameter]) -> list[Parameter]:
        """Return the parameters to set, including all those of a preset among them.

        Explicit values override the preset's; all are accepted together, or none. A file goes on
        to bring the element until it is left for nothing or for another preset than its own.
        """
        changed = [self._read(self._double(parameter)) for parameter in changed]
        given = {parameter.name: parameter.value for parameter in changed}
        if LEVEL in given and WORD not in given:
            changed.append(Parameter(WORD, value=''))
        self._asked = set(given)
        file = self._value(FILE)
        leaving = bool(file) and given.get(FILE) == ''
        name = given.get(PRESET, self._value(PRESET) if leaving else None)
        if self.locked and name == self._value(PRESET):  # as a dump that is loaded says
            return changed
        of_the_file = bool(file) and not leaving and name == self._value(PRESET)
        if name not in tuple(PRESETS) or of_the_file:
            return changed
        others = {*given, *OF_THE_NODE, *LIVE}
        self.ask_all()
        return [
            *changed,
            Parameter(FILE, value=''),
            *([] if LAW in given else [Parameter(LAW, value='')]),
            *(
                Parameter(key, value=value)
                for key, value, _ in declarations(preset(name))
                if key.split('.')[0] in OF_A_PRESET and key not in others
            ),
        ]

    def _warn_of_strangers(self) -> None:
        """Warn of given parameters that do not exist, such as misspelt ones."""
        for name in sorted(self._given):
            if not (self._node.has_parameter(name) or name.startswith('qos_overrides.')):
                told = f'there is no parameter {name}: it is ignored{self._alike(name)}'
                self._node.get_logger().warning(told)

    def check_names(self, names: list[str]) -> None:
        """Raise `ParameterNotDeclaredException` for the first that is of no parameter."""
        for name in names:
            if name and not self._node.has_parameter(name):  # `_check` refuses an empty one
                raise ParameterNotDeclaredException(clipped(name) + self._alike(name))

    def _alike(self, name: str) -> str:
        """Return which parameter has a name like this one."""
        known = sorted({*self._node.get_parameters_by_prefix(''), *self._undeclared})
        alike = difflib.get_close_matches(name, known, 1)
        return f'; did you mean {alike[0]}?' if alike else ''

    def _read(self, parameter: Parameter) -> Parameter:
        """Return a law whose file is named as its text, which goes where the file does not."""
        if parameter.name == LAW and isinstance(parameter.value, str):
            with suppress(SettingsError):  # `_check` tells it
                return Parameter(LAW, value=self._law_in(parameter.value))
        return parameter

    def _double(self, parameter: Parameter) -> Parameter:
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


def _is_fault(parameter: Parameter) -> bool:
    name: str = parameter.name
    return name.startswith(FAULTS)


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

    known: ParameterSet | None = None

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
        """Return a parameter; the digest is that of the present values."""
        if name == DIGEST and self.known is not None:
            return Parameter(name, value=self.known.digest())
        return super().get_parameter(name)
