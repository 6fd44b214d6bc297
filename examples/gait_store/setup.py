# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
from setuptools import setup

PACKAGE = 'gait_store'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=[PACKAGE],
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/launch', ['launch/robot.launch.py']),
    ],
    install_requires=['setuptools'],
    entry_points={'console_scripts': ['gait_node = gait_store.gait_node:main']},
    zip_safe=True,
)
