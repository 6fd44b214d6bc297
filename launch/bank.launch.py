# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Launch several elements as one word: ros2 launch mlmem_ros bank.launch.py elements:=4.

Element i is NAMESPACE/element_i/mlmem and holds the digit of weight p^i. `MemoryBank.on(node, 4)`
writes and reads them all at once. The arguments of memory.launch.py go to every element.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, ThisLaunchFileDir

MOST = 64
"""More elements than that are more likely a mistake than a word."""


def generate_launch_description() -> LaunchDescription:
    """Return the description: the arguments, and as many elements as they say."""
    return LaunchDescription(
        [
            DeclareLaunchArgument('elements', default_value='4', description='how many'),
            DeclareLaunchArgument(
                'namespace', default_value='/bank', description='namespace of the bank'
            ),
            DeclareLaunchArgument(
                'config',
                default_value='case_2',
                description='preset or parameter file of every element',
            ),
            DeclareLaunchArgument(
                'record', default_value='', description='folder of a session each; empty: none'
            ),
            DeclareLaunchArgument(
                'state', default_value='', description='folder of a state file each; empty: none'
            ),
            OpaqueFunction(function=elements),
        ]
    )


def elements(context: LaunchContext) -> list[IncludeLaunchDescription]:
    """Return one include of memory.launch.py for every element."""
    number, namespace, config, record, state = (
        LaunchConfiguration(name).perform(context)
        for name in ('elements', 'namespace', 'config', 'record', 'state')
    )
    if not number.isdecimal() or not 1 <= int(number) <= MOST:
        raise ValueError(f'elements must be a whole number from 1 to {MOST}; got {number!r}')
    one = PathJoinSubstitution([ThisLaunchFileDir(), 'memory.launch.py'])
    return [
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(one),  # each its own: a source keeps what it has loaded
            launch_arguments={
                'name': 'mlmem',
                'namespace': f'{namespace.rstrip("/")}/element_{place}',
                'config': config,
                'record.path': f'{record}/element_{place}' if record else '',
                'state.path': f'{state}/element_{place}.json' if state else '',
            }.items(),
        )
        for place in range(int(number))
    ]
