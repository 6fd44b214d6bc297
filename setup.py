# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

LIBRARY, PACKAGE, TOOLS = 'mlmem', 'mlmem_ros', 'mlmem_tools'
"""The memory itself, what a robot runs, and what people use around it."""

EXTRAS = {
    # ROS 2 Jazzy, or Kilted, from wheels; a robot has it from apt.
    'ros': [
        'ros-jazzy-rclpy==7.1.*',
        'ros-jazzy-common-interfaces==5.3.*',
        'ros-jazzy-rmw-fastrtps-cpp==8.4.*',
    ],
    'kilted': [
        'ros-kilted-rclpy==9.1.*',
        'ros-kilted-common-interfaces==5.5.*',
        'ros-kilted-rmw-fastrtps-cpp==9.3.*',
    ],
    'view': ['aiohttp>=3.9'],
    # pictures and data sets of `mlmem.simulate` and `mlmem.sweep`
    'research': ['matplotlib>=3.7', 'xarray>=2024.1', 'pandas>=2.0'],
    'test': [
        'coverage[toml]>=7.10',
        'pytest>=7.4',
        'pytest-timeout>=2.1',
        'pytest-xdist>=3.4',
        'hypothesis>=6.98',
        'greenlet>=3',
        'scipy>=1.11',
        'mpmath>=1.3',
        'aiohttp>=3.9',
        'selenium>=4.15',
        'xarray>=2024.1',
        'xacro>=2.0',
    ],
    'docs': ['sphinx>=8.1', 'furo>=2024.8', 'myst-parser>=4.0'],
    # examples/walking_robot
    'robot': ['mujoco>=3.2', 'matplotlib>=3.7'],
    'mutation': ['mutmut>=3.8'],
    'lint': ['ruff>=0.17', 'mypy>=2.4'],
}


class BuildWithElements(build_py):
    """Put the files of the shipped elements into the library."""

    def run(self):
        super().run()
        if self.editable_mode:  # they are in the checkout
            return
        folder = Path(self.build_lib, LIBRARY, 'elements')
        self.mkpath(str(folder))
        for file in glob('config/*.yaml'):
            if file != 'config/example.yaml':
                self.copy_file(file, str(folder))


setup(
    name=PACKAGE,
    cmdclass={'build_py': BuildWithElements},
    version='1.0.0',
    description='Mechanical multi-level memory for robots, as a ROS 2 device',
    license='Apache-2.0',
    maintainer='The mlmem_ros authors',
    packages=find_packages(
        include=[f'{name}{below}' for name in (LIBRARY, PACKAGE, TOOLS) for below in ('', '.*')]
    ),
    package_data={
        f'{PACKAGE}.ros': ['*.xml'],
        f'{PACKAGE}.testing': ['*.xml'],
        f'{TOOLS}.view': ['static/*', 'static/*/*'],
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/hook', ['resource/path.dsv']),  # colcon.pkg: the commands are on PATH
        (f'share/{PACKAGE}/config', glob('config/*.*')),
        (f'share/{PACKAGE}/ros2_control', glob('config/ros2_control/*')),
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
    ],
    python_requires='>=3.10',
    install_requires=[
        'setuptools',
        'numpy>=1.24',
        'numba>=0.58,<0.69',
        'pyyaml>=6.0',
        # Commands and sessions; a robot has them from apt or pip (docs/robot.md).
        'rich>=13.0',
        'mcap>=1.6',
        'rosbags>=0.11',
        'lz4>=4.0',
        'zstandard>=0.20',
    ],
    extras_require=EXTRAS,
    entry_points={
        'console_scripts': [
            'memory_node = mlmem_ros.ros.main:main',
            'memory_bank = mlmem_ros.ros.main:bank',
            'memory_monitor = mlmem_tools.identification.monitor_node:main',
            'mlmem = mlmem_tools.cli.main:main',
        ],
        # How mlmem_ros reaches mlmem_tools, which imports it.
        'mlmem_ros.tools': [
            'command_line = mlmem_tools.cli.main:main',
            'design_check = mlmem_tools.checks:check',
            'BankCheckFailed = mlmem_tools.bank.bank:BankCheckFailed',
            'BankValue = mlmem_tools.bank.bank:BankValue',
            'MemoryBank = mlmem_tools.bank.bank:MemoryBank',
        ],
    },
    zip_safe=True,
)
