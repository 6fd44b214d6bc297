# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The memory in a larger stack: ros2 launch gait_store robot.launch.py.

The memory runs in the namespace of the robot; the behaviour starts once it is active. This file
also takes the arguments of memory.launch.py.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, RegisterEventHandler
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.event_handlers import OnStateTransition
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the description: the launch activates the memory, then starts the behaviour."""
    memory = PathJoinSubstitution([FindPackageShare('mlmem_ros'), 'launch', 'memory.launch.py'])
    namespace = LaunchConfiguration('robot')
    behaviour = Node(
        package='gait_store',
        executable='gait_node',
        namespace=namespace,
        parameters=[{'memory': 'mlmem'}],
        output='screen',
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument('robot', default_value='/robot', description='its namespace'),
            RegisterEventHandler(OnStateTransition(goal_state='active', entities=[behaviour])),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(memory),
                launch_arguments={
                    'node_namespace': namespace,
                    'node_managed': 'true',
                    'linger': '3.0',  # it outlives the behaviour, which may write a last time
                }.items(),
            ),
        ]
    )
