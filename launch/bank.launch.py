# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Launch several elements that hold one value: ros2 launch mlmem_ros bank.launch.py elements:=4.

One process runs them. Element i is NODE_NAMESPACE/element_i/mlmem and holds the digit of weight
p^i, the last one a check digit. `MemoryBank.on(node, 4)` writes and reads them all at once. The
arguments of memory.launch.py apply to every element; a parameter file may have a section for each,
by its full name.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, ThisLaunchFileDir

ARGUMENTS = {
    'elements': ('4', 'number of elements'),
    'node_namespace': ('/bank', 'namespace of the bank'),
    'element': ('case_2', 'shipped element or element file of all elements'),
    'record.path': ('', 'folder of the sessions; empty: none'),
    'state.path': ('', 'folder of the state files; empty: none'),
}


def generate_launch_description() -> LaunchDescription:
    """Return the launch description: the arguments, and the bank."""
    passed = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    one = PathJoinSubstitution([ThisLaunchFileDir(), 'memory.launch.py'])
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=text)
                for name, (default, text) in ARGUMENTS.items()
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(one), launch_arguments=passed.items()
            ),
        ]
    )
