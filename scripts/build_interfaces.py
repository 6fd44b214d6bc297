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

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / 'mlmem_interfaces', ROOT / 'scripts' / 'simulation_interfaces'
HOME = Path(sys.prefix)
CACHE = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache', 'mlmem_ros')

GENERATORS = (
    'ament-cmake', 'ament-cmake-ros', 'ament-package', 'ament-cmake-include-directories',
    'ament-cmake-gmock', 'ament-cmake-gtest', 'ament-cmake-pytest', 'rosidl-default-generators',
    'rosidl-core-generators',
)  # fmt: skip
"""Wheels that make interfaces; they do not declare all that they depend on."""

OWN = {'jazzy': 'python-cmake-module', 'kilted': 'ament-cmake-ros-core'}
"""One more of each distribution."""

BUILT, FAILED, NO_TOOLS = 0, 1, 2
"""Exit status: installed; the build failed; this machine lacks the tools to build it."""


def main() -> int:
    """Build and install the packages unless they are current; return the worst exit status."""
    return max(made(source) for source in SOURCES)


def made(source: Path) -> int:
    """Build and install a package unless it is current; return the exit status."""
    name, key = source.name, fingerprint(source)
    stamp = HOME / f'{name}.stamp'
    installed = (HOME / 'share' / name).exists()
    if installed and stamp.exists() and stamp.read_text() == key:
        return BUILT
    kept = CACHE / f'{name}-{key[:16]}'
    if not kept.exists():
        missing = [tool for tool in ('cmake', 'c++', 'make') if not shutil.which(tool)]
        if missing:
            print(f'{name} is not built: {", ".join(missing)} is missing')
            return NO_TOOLS
        print(f'building {name}: a minute, once', flush=True)
        try:
            build(source, kept)
        except subprocess.CalledProcessError as failure:
            print(failure.output[-4000:], file=sys.stderr)
            print(f'{name} could not be built: {failure}', file=sys.stderr)
            return FAILED
    shutil.copytree(kept, HOME, dirs_exist_ok=True)
    stamp.write_text(key)
    return BUILT


def fingerprint(source: Path) -> str:
    """Return a hash of what a build depends on: sources, Python, the wheels."""
    sources = sorted(path for path in source.rglob('*') if path.is_file())
    parts = [path.read_bytes() for path in sources]
    parts += [text.encode() for text in (sys.version, version('ros-rclpy'), version('numpy'))]
    return hashlib.sha256(b'\0'.join(parts)).hexdigest()


def build(source: Path, target: Path) -> None:
    """Build a package into a folder, completely or not at all.

    Raises:
        subprocess.CalledProcessError: A step failed.
    """
    run(
        sys.executable, '-m', 'pip', 'install', '--quiet', '--disable-pip-version-check', *wheels()
    )
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
        run('cmake', '-G', 'Unix Makefiles', '-S', source, '-B', built, *given)
        run('cmake', '--build', built, '--parallel', os.cpu_count() or 1)
        run('cmake', '--install', built)
        shutil.rmtree(target, ignore_errors=True)
        made.rename(target)


def wheels() -> list[str]:
    """Return the wheels that make interfaces for the distribution of this environment."""
    installed = {each.name for each in distributions()}
    distribution = next(name for name in OWN if f'ros-{name}-rclpy' in installed)
    names = *GENERATORS, OWN[distribution]
    return ['catkin_pkg', *(f'ros-{distribution}-{name}' for name in names)]


def correct_wheels() -> None:
    """Remove from the CMake files of the wheels the paths of Python and numpy of their build."""
    for path in HOME.glob('share/*/cmake/*__rosidl_generator_pyExport.cmake'):
        text = path.read_text()
        corrected = re.sub(r'(INTERFACE_INCLUDE_DIRECTORIES )"/opt/python/[^"]*"', r'\1""', text)
        if corrected != text:
            path.write_text(corrected)


def run(*command: object) -> None:
    """Run a step; what it prints is kept for its failure."""
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
