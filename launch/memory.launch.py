# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Launch one memory element: ros2 launch mlmem_ros memory.launch.py config:=case_2."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the description: one node, its parameter file and where it records."""
    shipped = sorted(path.stem for path in Path(__file__).parent.parent.glob('config/*.yaml'))
    config = PathJoinSubstitution(
        [FindPackageShare('mlmem_ros'), 'config', LaunchConfiguration('config')]
    )
    record = ParameterValue(LaunchConfiguration('record'), value_type=str)
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'config', default_value='case_2', choices=shipped, description='parameter file'
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
                parameters=[ParameterFile([config, '.yaml']), {'record.path': record}],
                output='screen',
            ),
        ]
    )
