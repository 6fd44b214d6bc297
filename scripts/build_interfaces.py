# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Build the packages of messages into this Python's environment of ROS wheels.

.venv/bin/python scripts/build_interfaces.py
.venv-kilted/bin/python scripts/build_interfaces.py

They are the actions, mlmem_interfaces, and the part of the standard simulation_interfaces that a
node serves, which is in no wheel. It needs cmake, a C++ compiler and a minute. The result is kept
in the user's cache. A robot builds the first by colcon instead (docs/robot.md) and has the
second from apt.
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import distributions, version
from pathlib import Path

CHECKOUT_ROOT = Path(__file__).resolve().parent.parent
PACKAGE_FOLDERS = (
    CHECKOUT_ROOT / 'mlmem_interfaces',
    CHECKOUT_ROOT / 'scripts' / 'interfaces' / 'simulation_interfaces',
)
ENVIRONMENT_FOLDER = Path(sys.prefix)
CACHE_FOLDER = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache', 'mlmem_ros')

GENERATOR_WHEELS = (
    'ament-cmake', 'ament-cmake-ros', 'ament-package', 'ament-cmake-include-directories',
    'ament-cmake-gmock', 'ament-cmake-gtest', 'ament-cmake-pytest', 'rosidl-default-generators',
    'rosidl-core-generators',
)  # fmt: skip
"""Wheels that make interfaces; they do not declare all that they depend on."""

DISTRIBUTION_WHEELS = {'jazzy': 'python-cmake-module', 'kilted': 'ament-cmake-ros-core'}
"""One more of each distribution."""

EXIT_BUILT, EXIT_FAILED, EXIT_NO_TOOLS = 0, 1, 2
"""Exit status: installed; the build failed; this machine lacks the tools to build it."""


def main() -> int:
    """Build and install the packages unless they are current; return the worst exit status."""
    return max(build_if_stale(source) for source in PACKAGE_FOLDERS)


def build_if_stale(source: Path) -> int:
    """Build and install a package unless it is current; return the exit status."""
    name, key = source.name, hash_inputs(source)
    stamp = ENVIRONMENT_FOLDER / f'{name}.stamp'
    installed = (ENVIRONMENT_FOLDER / 'share' / name).exists()
    if installed and stamp.exists() and stamp.read_text() == key:
        return EXIT_BUILT
    kept = CACHE_FOLDER / f'{name}-{key[:16]}'
    if not kept.exists():
        missing = [tool for tool in ('cmake', 'c++', 'make') if not shutil.which(tool)]
        if missing:
            print(f'{name} is not built: {", ".join(missing)} is missing')
            return EXIT_NO_TOOLS
        print(f'building {name}: a minute, once', flush=True)
        try:
            build_package(source, kept)
        except subprocess.CalledProcessError as failure:
            print(failure.output[-4000:], file=sys.stderr)
            print(f'{name} could not be built: {failure}', file=sys.stderr)
            return EXIT_FAILED
    shutil.copytree(kept, ENVIRONMENT_FOLDER, dirs_exist_ok=True)
    stamp.write_text(key)
    return EXIT_BUILT


def hash_inputs(source: Path) -> str:
    """Return a hash of what a build depends on: sources, Python, the wheels."""
    sources = sorted(path for path in source.rglob('*') if path.is_file())
    parts = [path.read_bytes() for path in sources]
    parts += [text.encode() for text in (sys.version, version('ros-rclpy'), version('numpy'))]
    return hashlib.sha256(b'\0'.join(parts)).hexdigest()


def build_package(source: Path, target: Path) -> None:
    """Build a package into a folder, completely or not at all.

    Raises:
        subprocess.CalledProcessError: A step failed.
    """
    run_step(
        sys.executable,
        '-m',
        'pip',
        'install',
        '--quiet',
        '--disable-pip-version-check',
        *list_wheels(),
    )
    correct_wheels()
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        build_if_stale, built = Path(folder, 'install'), Path(folder, 'build')
        options = {
            'CMAKE_INSTALL_PREFIX': build_if_stale,
            'Python3_EXECUTABLE': sys.executable,
            'BUILD_TESTING': 'OFF',
        }
        given = [f'-D{name}={value}' for name, value in options.items()]
        run_step('cmake', '-G', 'Unix Makefiles', '-S', source, '-B', built, *given)
        run_step('cmake', '--build', built, '--parallel', os.cpu_count() or 1)
        run_step('cmake', '--install', built)
        shutil.rmtree(target, ignore_errors=True)
        build_if_stale.rename(target)


def list_wheels() -> list[str]:
    """Return the wheels that make interfaces for the distribution of this environment."""
    installed = {each.name for each in distributions()}
    distribution = next(name for name in DISTRIBUTION_WHEELS if f'ros-{name}-rclpy' in installed)
    names = *GENERATOR_WHEELS, DISTRIBUTION_WHEELS[distribution]
    return ['catkin_pkg', *(f'ros-{distribution}-{name}' for name in names)]


def correct_wheels() -> None:
    """Remove from the CMake files of the wheels the paths of Python and numpy of their build."""
    for path in ENVIRONMENT_FOLDER.glob('share/*/cmake/*__rosidl_generator_pyExport.cmake'):
        text = path.read_text()
        corrected = re.sub(r'(INTERFACE_INCLUDE_DIRECTORIES )"/opt/python/[^"]*"', r'\1""', text)
        if corrected != text:
            path.write_text(corrected)


def run_step(*command: object) -> None:
    """Run a step; what it prints is kept for its failure."""
    environment = dict(
        os.environ,
        AMENT_PREFIX_PATH=str(ENVIRONMENT_FOLDER),
        CMAKE_PREFIX_PATH=str(ENVIRONMENT_FOLDER),
    )
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
