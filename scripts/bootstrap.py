# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make `.venv` in the checkout, with ROS 2 Jazzy from wheels, this package and its laboratory; or
`.venv-kilted` with ROS 2 Kilted.

python3 scripts/bootstrap.py demo|test|docs|test-kilted

Needs only the standard library. A current environment is left as it is.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

CHECKOUT_ROOT = VENV_PARENT = Path(__file__).resolve().parent.parent
STAGE_NEEDS = {
    'demo': ('.venv', '[ros,view]', '800 MB in all'),
    'test': ('.venv', '[ros,view,test,lint]', '1 GB in all'),
    'docs': ('.venv', '[ros,view,test,lint,docs]', '1.1 GB in all'),
    'test-kilted': ('.venv-kilted', '[kilted,view,test]', '900 MB in all'),
}
"""Of a command: its environment, the extras that it needs, and the size; each stage of an
environment includes those before it."""
ROBOT_ADVICE = (
    'On a robot or another platform use ROS 2 Jazzy from apt (Ubuntu 24.04) instead: install\n'
    'ros-jazzy-ros-base, clone this repository into a workspace, then run "rosdep install\n'
    '--from-paths src" and "colcon build"; docs/robot.md has the lines.'
)


def main(stage: str = 'demo') -> int:
    """Set up the environment if it is missing or out of date; return the exit status.

    Args:
        stage: What it is for, a key of `STAGE_NEEDS`.
    """
    folder, extras, size = STAGE_NEEDS[stage]
    venv = VENV_PARENT / folder
    stamp = venv / 'mlmem_ros.stamp'
    told = b''.join(
        (CHECKOUT_ROOT / each).read_bytes() for each in ('setup.py', 'lab/pyproject.toml')
    )
    wanted = hashlib.sha256(told + sys.version.encode()).hexdigest()
    found, _, reached = stamp.read_text().partition(' ') if stamp.exists() else ('', '', '')
    current = found == wanted
    if current and list(STAGE_NEEDS).index(stage) <= list(STAGE_NEEDS).index(reached):
        return 0
    if problem := find_missing_prerequisite():
        print(f'{problem}\n\n{ROBOT_ADVICE}', file=sys.stderr)
        return 1
    python = str(venv / 'bin' / 'python')
    install = [python, '-m', 'pip', 'install', '--quiet', '--disable-pip-version-check']
    text = f'installing what "make {stage}" needs: {size}, a minute or two'
    packages = ['--editable', f'{CHECKOUT_ROOT}{extras}', '--editable', f'{CHECKOUT_ROOT}/lab']
    steps = [(text, [*install, *packages])]
    if not current:
        steps.insert(0, (f'making {folder}', [sys.executable, '-m', 'venv', '--clear', str(venv)]))
    for number, (text, command) in enumerate(steps, 1):
        print(f'[{number}/{len(steps)}] {text}', flush=True)
        if subprocess.run(command, cwd=CHECKOUT_ROOT).returncode:
            if not current:
                shutil.rmtree(venv, ignore_errors=True)
            print(f'\nsetting up failed while {text}.\n{ROBOT_ADVICE}', file=sys.stderr)
            return 1
    stamp.write_text(f'{wanted} {stage}')
    return 0


def find_missing_prerequisite() -> str:
    """Return what this machine lacks for the wheels; empty if nothing."""
    version = sys.version_info
    if not (3, 10) <= version[:2] <= (3, 14):
        return (
            f'Python 3.10 to 3.14 is needed for the ROS 2 wheels; {sys.executable} is '
            f'{platform.python_version()}. Name another one: make PYTHON=python3.12 demo'
        )
    if sys.implementation.name != 'cpython':
        return f'CPython is needed for the ROS 2 wheels; this is {sys.implementation.name}.'
    if sys.platform != 'linux' or platform.machine() != 'x86_64':
        return (
            'The ROS 2 wheels exist for Linux on x86_64 only; this machine is '
            f'{sys.platform} on {platform.machine()}.'
        )
    library, release = platform.libc_ver()
    if library != 'glibc' or tuple(map(int, release.split('.')[:2])) < (2, 28):
        found = f'{library} {release}' if library else 'another C library'
        return f'The ROS 2 wheels need glibc 2.28 or newer; this is {found}.'
    try:
        import ensurepip
        import venv  # noqa: F401
    except ImportError as error:
        return (
            f'Python lacks its venv module ({error.name}); on Debian and Ubuntu: '
            f'sudo apt install python{version.major}.{version.minor}-venv'
        )
    del ensurepip
    if not os.access(CHECKOUT_ROOT, os.W_OK):
        return f'The checkout {CHECKOUT_ROOT} must be writable: .venv is made in it.'
    return ''


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
