# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Launch one memory element: ros2 launch mlmem_ros memory.launch.py element:=case_2.

Every parameter of the node is an argument (`--show-args` lists them), `element` among them: a
shipped element or the path of an element file. An empty one leaves the parameter as the file of
`params_file:=` says, or with its default. With
`node_managed:=true` the launch configures and activates the node, instead of the node itself. With
`elements:=4` it starts a bank, as bank.launch.py does.

Launch configurations are shared by all files of a launch. So the arguments have names that no
other file has by chance, and they are unset at the end: a second include begins with the defaults.
"""

import difflib
from typing import Any

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    OpaqueFunction,
    RegisterEventHandler,
    UnsetLaunchConfiguration,
)
from launch.events import matches_action
from launch.logging import get_logger
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode, Node
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from lifecycle_msgs.msg import Transition

from mlmem.element_file import element_path
from mlmem.schema import Description
from mlmem_ros.host.settings import declare_parameters

SIGTERM_TIMEOUT = 5.0
"""Seconds after SIGINT that launch gives a process which does not linger."""

TRUTH = {'true': True, 'false': False}


def generate_launch_description() -> LaunchDescription:
    """Return the launch description: the arguments, and the node."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'params_file', default_value='', description='ROS parameter file; empty: none'
            ),
            DeclareLaunchArgument(
                'node_name', default_value='mlmem', description='name of the node'
            ),
            DeclareLaunchArgument('node_namespace', default_value='', description='its namespace'),
            DeclareLaunchArgument(
                'node_managed',
                default_value='false',
                choices=list(TRUTH),
                description='whether the launch configures and activates the node',
            ),
            DeclareLaunchArgument(
                'elements',
                default_value='',
                description='number of elements of a bank in one process, whose record.path and '
                'state.path are folders; empty: one element',
            ),
            *(argument(*declaration) for declaration in declare_parameters()),
            OpaqueFunction(function=element),
            OpaqueFunction(function=unset_arguments),
        ]
    )


def unset_arguments(_: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return what unsets the arguments, so that no later file of the launch gets them."""
    arguments = generate_launch_description().get_launch_arguments()
    return [UnsetLaunchConfiguration(each.name) for each in arguments]


def argument(name: str, default: Any, description: Description) -> DeclareLaunchArgument:
    """Return the launch argument of a parameter."""
    unit = f' [{description.unit}]' if description.unit else ''
    choices = list(TRUTH) if isinstance(default, bool) else list(description.choices)
    return DeclareLaunchArgument(
        name,
        default_value='',
        choices=['', *choices] if choices else None,
        description=f'{description.text}{unit}; empty: as configured',
    )


def element(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the node with the given parameters, and what activates it."""
    warn_of_strangers(context)
    given = {
        name: value(name, text, default)
        for name, default, _ in declare_parameters()
        if (text := LaunchConfiguration(name).perform(context))
    }
    managed = TRUTH[LaunchConfiguration('node_managed').perform(context)]
    if 'element' in given:
        given['element'] = element_path(given['element'])
    file = LaunchConfiguration('params_file').perform(context)
    parameters = [*([file] if file else []), given]
    if number := LaunchConfiguration('elements').perform(context):
        if managed:
            raise ValueError('node_managed must be false with elements')
        return [bank(number, parameters)]
    if managed:
        given['autostart'] = False
    node = LifecycleNode(
        package='mlmem_ros',
        executable='memory_node',
        sigterm_timeout=f'{SIGTERM_TIMEOUT + given.get("linger", 0.0)}',
        name=LaunchConfiguration('node_name').perform(context),
        namespace=LaunchConfiguration('node_namespace').perform(context),
        parameters=parameters,
        output='screen',
    )
    return life_cycle(node) if managed else [node]


def warn_of_strangers(context: LaunchContext) -> None:
    """Warn of arguments on the command line that only look like ours, such as misspelt ones.

    Others, such as `device:=`, may be those of a launch file that includes this one.
    """
    logger = get_logger('memory.launch')
    known = [each.name for each in generate_launch_description().get_launch_arguments()]
    groups = {name.split('.')[0] for name in known if '.' in name}
    for name in (text.partition(':=')[0] for text in context.argv if ':=' in text):
        alike = difflib.get_close_matches(name, known, 1, cutoff=0.8)
        if name not in known and (alike or ('.' in name and name.split('.')[0] in groups)):
            hint = f'; did you mean {alike[0]}?' if alike else ''
            logger.warning(f'there is no argument {name}: it is ignored{hint}')


def bank(number: str, parameters: list[Any]) -> Node:
    """Return the process of several elements."""
    given = parameters[-1]
    folders = [
        word
        for option in ('record', 'state')
        if (folder := given.pop(f'{option}.path', ''))
        for word in (f'--{option}', folder)
    ]
    actions = ['--actions'] if given.pop('actions', False) else []
    return Node(
        package='mlmem_ros',
        executable='memory_bank',
        sigterm_timeout=f'{SIGTERM_TIMEOUT + given.get("linger", 0.0)}',
        namespace=LaunchConfiguration('node_namespace'),
        arguments=['--elements', number, *folders, *actions],
        parameters=parameters,
        output='screen',
    )


def value(name: str, text: str, default: Any) -> bool | int | float | str:
    """Return the value of an argument, in the type of the parameter."""
    kind = type(default)
    try:
        return TRUTH[text] if kind is bool else kind(text)
    except ValueError:
        noun = 'a whole number' if kind is int else 'a number'
        raise ValueError(f'{name} must be {noun}; got {text!r}') from None


def life_cycle(node: LifecycleNode) -> list[LaunchDescriptionEntity]:
    """Return a node, what configures it, and what activates it after that."""
    configured = OnStateTransition(
        target_lifecycle_node=node,
        start_state='configuring',
        goal_state='inactive',
        entities=[change(node, Transition.TRANSITION_ACTIVATE)],
    )
    return [
        RegisterEventHandler(configured),
        node,
        change(node, Transition.TRANSITION_CONFIGURE),
    ]


def change(node: LifecycleNode, transition: int) -> EmitEvent:
    """Return the event that requests a transition of a node."""
    event = ChangeState(lifecycle_node_matcher=matches_action(node), transition_id=transition)
    return EmitEvent(event=event)
