# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a memory node is asked for: its services and actions, and what `~/request` takes: the
procedures, a strain profile and a recording, with their arguments; how a client encodes a request,
and how the node decodes it.

Messages check their fields only if ROS_PYTHON_CHECK_FIELDS is 1, and never under `python -O`.
Without a check a text where a number belongs may end the process. So `build_parameter` checks
values before a message takes them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from numbers import Integral
from typing import TYPE_CHECKING, Any, NamedTuple, get_type_hints

import numpy as np

from mlmem import ErrorCode, Refused
from mlmem.parsing import decode_value
from mlmem.procedure_table import CONTENT_NAMES, PROCEDURES, UNSET_CONTENT, Procedure, Write
from mlmem.schema import short_repr

from .topics import load_installed

if TYPE_CHECKING:
    from mlmem import Command


@dataclass(frozen=True)
class Record:
    """A request to the node itself: start or stop recording a session.

    Attributes:
        on: Whether to start.
        path: The bag; if empty, the parameter `record.path`.
    """

    on: bool = True
    path: str = ''


# --- requests ---------------------------------------------------------------------------------

PARAMETER_TYPES = {
    bool: 'BOOL', int: 'INTEGER', float: 'DOUBLE', str: 'STRING', tuple[float, ...]: 'DOUBLE_ARRAY'
}  # fmt: skip
"""The types of arguments and parameters, and the names of `rclpy.parameter.Parameter.Type`."""

WRITE_ARGUMENTS = *CONTENT_NAMES, 'content'
"""What a request to write may name its content: the last is right for every element."""

REQUEST_ARGUMENTS: dict[str, Mapping[str, Any]] = {
    **{
        name: {
            argument: {'float': float, 'int': int, 'str': str}[kind]
            for argument, kind, *_ in row.arguments
        }
        for name, row in PROCEDURES.items()
    },
    'write': dict.fromkeys(WRITE_ARGUMENTS, int),
    'follow': dict.fromkeys(('times', 'strains', 'rates'), tuple[float, ...]),
    'record': get_type_hints(Record),
}
"""The types of the arguments of all requests, by name: keys of `PARAMETER_TYPES`."""


def find_parameter_types(name: Any, given: Iterable[str]) -> dict[str, Any]:
    """Return the types of the parameters that make a request: `request`, which names it, its
    arguments, and for a procedure `deadline`, the seconds within which it must begin.

    Raises:
        Refused: There is no such request, or it does not take one of the given parameters.
    """
    if name not in REQUEST_ARGUMENTS:
        known = ', '.join(REQUEST_ARGUMENTS)
        raise Refused.out_of_range('request', name, f'one of {known}')
    more = {'deadline': float} if name in PROCEDURES else {}
    types = {'request': str, **REQUEST_ARGUMENTS[name], **more}
    for parameter in given:
        if parameter not in types:
            known = ', '.join(REQUEST_ARGUMENTS[name]) or 'none'
            raise Refused(ErrorCode.UNKNOWN_FIELD, str(parameter), expected=known, place=name)
    return types


# --- the client's side ------------------------------------------------------------------------


def build_parameter(name: str, value: Any, kind: Any = None) -> Any:
    """Return a rcl_interfaces/msg/Parameter.

    Args:
        value: Its value; one of NumPy is converted.
        kind: Its type, a key of `PARAMETER_TYPES`; by default that of the value.

    Raises:
        ValueError: The value is not of this type, or of none that a parameter takes.
    """
    from rclpy.parameter import Parameter

    plain = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    kind = kind or type(plain)
    if kind not in PARAMETER_TYPES:
        raise ValueError(
            f'{name} must be true or false, a number or a text; got {short_repr(value)}'
        )
    if not (kind is float and plain == math.inf):  # as a deadline may be
        plain = decode_value(kind, plain, name)
    if kind is str and '\0' in plain:  # messages end a text there
        raise ValueError(f'{name} must be a text without NUL; got {short_repr(value)}')
    return Parameter(name, Parameter.Type[PARAMETER_TYPES[kind]], plain).to_parameter_msg()


def build_request(name: str, **arguments: Any) -> Any:
    """Return a request as a rcl_interfaces/srv/SetParametersAtomically.Request; omitted arguments
    take the command's defaults.

    Raises:
        ValueError: There is no such request, or an argument is not of its type.
    """
    from rcl_interfaces.srv import SetParametersAtomically

    try:
        types = find_parameter_types(name, arguments)
    except Refused as refusal:
        raise ValueError(f'{refusal}') from None
    given = {'request': name, **arguments}
    return SetParametersAtomically.Request(
        parameters=[build_parameter(key, value, types[key]) for key, value in given.items()]
    )


def check_content(level: Any) -> int:
    """Return a content to write.

    Raises:
        ValueError: It is not a whole number from 0.
    """
    if isinstance(level, Integral) and not isinstance(level, bool) and int(level) >= 0:
        return int(level)
    raise ValueError(f'level must be a whole number of at least 0; got {short_repr(level)}')


# --- the node's side --------------------------------------------------------------------------


def parse_request(
    parameters: Sequence[Any], content_name: str = ''
) -> tuple[Command | Record, float]:
    """Return the command in the parameters of a request, whose values the device checks, and the
    seconds for which it waits for its turn; 0 if it does not say so.

    Args:
        content_name: As `build_command` takes it.

    Raises:
        Refused: It is not a request, or has the wrong arguments.
    """
    given = {parameter.name: parameter.value for parameter in parameters}
    if len(given) != len(parameters):
        why = 'a request must name every argument once'
        raise Refused(ErrorCode.CONFLICT, reason=why)
    name = _read_value('request', given['request'], str) if 'request' in given else None
    types = find_parameter_types(name, given)
    values = {key: _read_value(key, value, types[key]) for key, value in given.items()}
    del values['request']
    wait = values.pop('deadline', None)
    if wait is not None and not wait > 0.0:
        raise Refused.out_of_range('deadline', wait, 'a number of seconds above 0')
    return build_command(str(name), values, content_name), wait or 0.0


def _read_value(name: str, value: Any, kind: Any) -> Any:
    """Return what is in a ParameterValue; raise `Refused` if it is not of a type."""
    from rclpy.parameter import Parameter

    wanted = Parameter.Type[PARAMETER_TYPES[kind]]
    if value.type != wanted.value:
        expected = f'of type {wanted.value} ({wanted.name})'
        raise Refused.out_of_range(name, value.type, expected)
    return getattr(value, f'{wanted.name.lower()}_value')


def build_command(name: str, given: Mapping[str, Any], content_name: str = '') -> Any:
    """Return the command of a request with its arguments, by name.

    Args:
        content_name: What the element holds, `level` or `word`; empty if that is not known.

    Raises:
        Refused: An argument is missing, or a content is named twice or not as the element's.
    """
    from mlmem import FollowTrajectory  # a client needs none, and no physics

    others = {'follow': FollowTrajectory, 'record': Record}
    kind = PROCEDURES[name].command if name in PROCEDURES else others[name]
    values = {'level': _select_content(given, content_name)} if kind is Write else dict(given)
    needed = (field.name for field in fields(kind) if field.default is MISSING)
    for argument in needed:
        if argument not in values:
            raise Refused(ErrorCode.MISSING_FIELD, argument, expected=f'{name} needs it')
    return kind(**values)


def _select_content(given: Mapping[str, Any], content_name: str) -> Any:
    """Return what to write; raises as `build_command`."""
    contents = {
        name: given[name]
        for name in WRITE_ARGUMENTS
        if given.get(name, UNSET_CONTENT) != UNSET_CONTENT
    }
    if not contents:
        expected = (
            'write takes level (of one wall), word (of a register) or content (of either); '
            '~/write takes it from the parameter target_level or target_word'
        )
        name = content_name or 'content'
        raise Refused(ErrorCode.MISSING_FIELD, name, expected=expected)
    for name in CONTENT_NAMES:
        if name in contents and content_name not in ('', name):
            kind = 'a register' if name == 'level' else 'an element with one wall'
            expected = f'{UNSET_CONTENT} (not set) for {kind}, which holds a {content_name}'
            raise Refused(ErrorCode.UNSUPPORTED, name, contents[name], expected)
    (first, content), *others = contents.items()
    if others:
        expected = f'{UNSET_CONTENT} (not set) next to {first}'
        raise Refused(ErrorCode.CONFLICT, *others[0], expected)
    return content


# --- services ---------------------------------------------------------------------------------


class Service(NamedTuple):
    """A service.

    Attributes:
        name: Below the node's name.
        type: Its type.
        meaning: What it does, for the reference page.
    """

    name: str
    type: str
    meaning: str


def _build_service(name: str, row: Procedure) -> Service:
    """Return the service of a procedure; what it must be given is a parameter of the node."""
    given = ' or '.join(f'`{parameter}`' for parameter in row.target_parameters.values())
    type_ = 'diagnostic_msgs/srv/SelfTest' if name == 'self_test' else 'std_srvs/srv/Trigger'
    return Service(name, type_, f'{row.meaning}; it takes {given}' if given else row.meaning)


NODE_SERVICES = (
    *(_build_service(name, row) for name, row in PROCEDURES.items() if row.has_service),
    Service(
        'request',
        'rcl_interfaces/srv/SetParametersAtomically',
        'a procedure with arguments; the JSON object is in `reason`',
    ),
    Service(
        'pause',
        'std_srvs/srv/SetBool',
        'hold or resume time; commands meanwhile take effect with the next tick',
    ),
    Service('step', 'std_srvs/srv/Trigger', 'run one tick while time is held'),
    Service(
        'record',
        'std_srvs/srv/SetBool',
        'start or stop recording a session to `record.path`; if that exists or is empty, the '
        'name gets the time',
    ),
)
"""All of them. Procedures answer when they have ended, with one JSON object."""

SIMULATOR_SERVICES = tuple(
    Service(name, f'simulation_interfaces/srv/{name.title().replace("_", "")}', meaning)
    for name, meaning in (
        ('get_simulator_features', 'all of these; resets only of a simulated element'),
        (
            'get_entities',
            'the full names of the elements of its process; filters are not supported',
        ),
        (
            'get_simulation_state',
            'playing or paused while active, stopped while inactive, without a world while '
            'unconfigured',
        ),
        (
            'set_simulation_state',
            'play, pause or stop; a stopped element begins anew, as by `~/reset_simulation`. 102: '
            'it could not be reached',
        ),
        (
            'step_simulation',
            'run ticks while paused, answered once the events of the last are published',
        ),
        (
            'reset_simulation',
            'begin anew at tick 0 with `initial_content` and the random numbers of `faults.seed`; '
            'state and time are reset together (scope 0, 3 or 255)',
        ),
    )
)
"""What a node answers as a simulator, where `simulation_interfaces` is installed."""

# --- actions ----------------------------------------------------------------------------------

ACTION_TYPE_NAMES = {name: row.command.__name__ for name, row in PROCEDURES.items() if row.action}
"""The requests that are also actions, with the names of their types."""


def load_action_types() -> dict[str, Any]:
    """Return the types of `ACTION_TYPE_NAMES` by request; none if the interfaces are not built."""
    names = ACTION_TYPE_NAMES.items()
    return load_installed({name: f'mlmem_interfaces/action/{kind}' for name, kind in names})
