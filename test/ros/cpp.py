# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Programs in C++, built where ROS 2 from apt is: wheels have no headers."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

PREFIXES = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)


def built(source, folder, *packages):
    """Build a folder of sources into another one, or skip for want of a package or a compiler."""
    for package in packages:
        if not any((Path(each) / 'share' / package).is_dir() for each in PREFIXES if each):
            pytest.skip(f'there is no {package}: wheels do not have it, apt does')
    if shutil.which('cmake') is None or shutil.which('c++') is None:
        pytest.skip('there is no cmake or no C++ compiler')
    subprocess.run(['cmake', '-S', source, '-B', folder], check=True)
    subprocess.run(['cmake', '--build', folder], check=True)
    return folder
