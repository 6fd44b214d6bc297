# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Launch one memory element: ros2 launch mlmem_ros memory.launch.py config:=case_2."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the description: one node, its parameter file and where it records."""
    shipped = sorted(path.stem for path in Path(__file__).parent.parent.glob('config/*.yaml'))
    config = PathJoinSubstitution(
        [FindPackageShare('mlmem_ros'), 'config', [LaunchConfiguration('config'), '.yaml']]
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'config', default_value='case_2', description=f'one of {", ".join(shipped)}'
            ),
            DeclareLaunchArgument('name', default_value='mlmem', description='name of the node'),
            DeclareLaunchArgument('namespace', default_value='', description='its namespace'),
            DeclareLaunchArgument(
                'record', default_value='', description='bag directory of a session; empty: none'
            ),
            Node(
                package='mlmem_ros',
                executable='memory_node',
                name=LaunchConfiguration('name'),
                namespace=LaunchConfiguration('namespace'),
                parameters=[config, {'record.path': LaunchConfiguration('record')}],
                output='screen',
            ),
        ]
    )
