# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Watch and record an element at work: ros2 launch mlmem_ros demo.launch.py.

Starts an element that records a session, and RViz if it is installed. Send it requests, such as
`mlmem write 5`. The arguments of memory.launch.py apply, too.
"""

import time
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import (
    DeclareLaunchArgument,
    IncludeLaunchDescription,
    LogInfo,
    OpaqueFunction,
    UnsetLaunchConfiguration,
)
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, ThisLaunchFileDir
from launch_ros.actions import Node

LAYOUT = Path(__file__).parent.parent / 'config' / 'memory.rviz'


def generate_launch_description() -> LaunchDescription:
    """Return the launch description: an element, its session, and RViz."""
    session = f'sessions/{time.strftime("%Y%m%d-%H%M%S")}'
    one = PathJoinSubstitution([ThisLaunchFileDir(), 'memory.launch.py'])
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'record.path', default_value=session, description='bag directory of the session'
            ),
            DeclareLaunchArgument(
                'rviz',
                default_value='true',
                choices=['true', 'false'],
                description='whether to start RViz',
            ),
            IncludeLaunchDescription(PythonLaunchDescriptionSource(one)),
            OpaqueFunction(function=viewer, condition=IfCondition(LaunchConfiguration('rviz'))),
            UnsetLaunchConfiguration('rviz'),
        ]
    )


def viewer(_: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return RViz with the shipped layout, or advice if it is not installed."""
    try:
        get_package_prefix('rviz2')
    except PackageNotFoundError:
        return [LogInfo(msg='rviz2 is not installed; show the element with "mlmem view"')]
    return [Node(package='rviz2', executable='rviz2', arguments=['-d', str(LAYOUT)])]
