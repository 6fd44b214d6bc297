# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The services and actions of a memory node."""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple

from mlmem.procedure_table import PROCEDURES, Procedure


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


TRIGGER_TYPE = 'std_srvs/srv/Trigger'
SET_BOOL_TYPE = 'std_srvs/srv/SetBool'


def _build_service(name: str, row: Procedure) -> Service:
    """Return the service of a procedure; what it must be given is a parameter of the node."""
    given = ' or '.join(f'`{parameter}`' for parameter in row.target_parameters.values())
    type_ = 'diagnostic_msgs/srv/SelfTest' if name == 'self_test' else TRIGGER_TYPE
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
        SET_BOOL_TYPE,
        'hold or resume time; commands meanwhile take effect with the next tick',
    ),
    Service('step', TRIGGER_TYPE, 'run one tick while time is held'),
    Service(
        'record',
        SET_BOOL_TYPE,
        'start or stop recording a session to `record.path`; if that exists or is empty, the '
        'name gets the time',
    ),
)
"""All of them. Procedures answer when they have ended, with one JSON object."""

SIMULATOR_SERVICES = tuple(
    Service(name, f'simulation_interfaces/srv/{kind}', meaning)
    for name, kind, meaning in (
        (
            'get_simulator_features',
            'GetSimulatorFeatures',
            'all of these; resets only of a simulated element',
        ),
        (
            'get_entities',
            'GetEntities',
            'the full names of the elements of its process; filters are not supported',
        ),
        (
            'get_simulation_state',
            'GetSimulationState',
            'playing or paused while active, stopped while inactive, without a world while '
            'unconfigured',
        ),
        (
            'set_simulation_state',
            'SetSimulationState',
            'play, pause or stop; a stopped element begins anew, as by `~/reset_simulation`. 102: '
            'it could not be reached',
        ),
        (
            'step_simulation',
            'StepSimulation',
            'run ticks while paused, answered once the events of the last are published',
        ),
        (
            'reset_simulation',
            'ResetSimulation',
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
    try:
        module = import_module('mlmem_interfaces.action')
    except ImportError:  # a checkout has their source, without types
        return {}
    return {
        name: getattr(module, kind)
        for name, kind in ACTION_TYPE_NAMES.items()
        if hasattr(module, kind)
    }
