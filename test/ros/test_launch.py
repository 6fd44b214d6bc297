# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The installed package under the `ros2` command line, as on a robot.

All but the last test is skipped where there is no such command (the wheels have none) or the
package is not installed beside it: build it with colcon and source its set-up first.
"""

import contextlib
import os
import runpy
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from nodes import check_closed, element_file
from robot import Robot
from suite import TIMEOUT_S


def environment():
    """Return our environment without what the wheels set for this Python alone."""
    result = dict(os.environ)
    if result.pop('_ROS_WHEELS_BOOTSTRAP_COMPLETE', None):
        result.pop('LD_LIBRARY_PATH', None)
    return result


@pytest.fixture(scope='module')
def ros2():
    """Skip a test where the ros2 command line or our package is missing."""
    if shutil.which('ros2') is None:
        pytest.skip('the ros2 command line is not installed')
    find = ['ros2', 'pkg', 'prefix', 'mlmem_ros']
    if subprocess.run(find, env=environment(), timeout=TIMEOUT_S, check=False).returncode != 0:
        pytest.skip('mlmem_ros is not installed where the ros2 command line looks')


@contextlib.contextmanager
def running(folder, *command):
    """Run a ros2 command during a block, end it by SIGINT, check that it ended well.

    Its output is in a file of the folder, whose path is yielded.
    """
    path = folder / 'output.txt'
    with path.open('w') as output:
        process = subprocess.Popen(
            ['ros2', *command], env=environment(), stdout=output, stderr=output,
            start_new_session=True,
        )  # fmt: skip
    try:
        yield path
        process.send_signal(signal.SIGINT)
        process.wait(TIMEOUT_S)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    text = path.read_text()
    assert 'shut down' in text
    assert 'Traceback' not in text
    assert 'process has died' not in text


@contextlib.contextmanager
def launched(folder, element, *arguments):
    """Launch a node in a block; yield a robot that has found it, and the path of the output."""
    command = ('launch', 'mlmem_ros', 'memory.launch.py', *arguments)
    with running(folder, *command) as output, Robot(element) as robot:
        robot.next('wall')  # which it publishes when it is active
        yield robot, output


def test_launch_arguments_reach_the_node(ros2, tmp_path):
    bag = tmp_path / 'session'
    names = ('element:=case_1', 'node_name:=left', 'node_namespace:=arm', f'record.path:={bag}')
    with launched(tmp_path, '/arm/left', *names) as (robot, output):
        assert robot.get('element') == 'case_1'
        assert robot.get('record.path') == str(bag)
    assert 'process has finished cleanly' in output.read_text()
    assert {topic for topic, _, _ in check_closed(bag)} >= {'/arm/left/wall', '/arm/left/field'}


def test_launch_manages_a_node_with_a_parameter_file(ros2, tmp_path):
    file = tmp_path / 'params.yaml'
    file.write_text('/**: {ros__parameters: {element: bits_4, write: {attempts: 9}}}')
    arguments = ('node_managed:=true', 'node_name:=four', f'params_file:={file}')
    with launched(tmp_path, '/four', *arguments, 'read.end:=both') as (robot, _):
        names = ('element', 'write.attempts', 'read.end', 'autostart')
        assert tuple(map(robot.get, names)) == ('bits_4', 9, 'both', False)
        assert robot.trigger('read')['level'] == -1


def test_launch_bank_starts_two_elements(ros2, tmp_path):
    """Two elements, each with its own name and files."""
    element = element_file('case_2', {'scale.time': 1e-5})  # ten times as fast
    folders = (f'record.path:={tmp_path / "bags"}', f'state.path:={tmp_path / "states"}')
    arguments = ('elements:=2', f'element:={element}', *folders)
    command = ('launch', 'mlmem_ros', 'bank.launch.py', *arguments)
    with running(tmp_path, *command) as output:
        for place in range(2):
            with Robot(f'/bank/element_{place}/mlmem') as robot:
                robot.next('wall')
                assert robot.get('element') == element
    assert output.read_text().count('process has finished cleanly') == 1
    for place in range(2):
        assert (tmp_path / 'states' / f'element_{place}.json').is_file()
        assert check_closed(tmp_path / 'bags' / f'element_{place}')


def test_setup_installs_every_file(monkeypatch):
    """As colcon does, which runs `setup.py`."""
    import setuptools  # which takes half a second, in every process that collects this file

    given = {}
    monkeypatch.setattr(setuptools, 'setup', given.update)
    monkeypatch.chdir(Path(__file__).parents[2])
    runpy.run_path('setup.py')
    folders = {folder: {Path(file) for file in files} for folder, files in given['data_files']}
    assert folders['share/ament_index/resource_index/packages'] == {Path('resource/mlmem_ros')}
    for folder in ('config', 'launch'):
        shipped = {path for path in Path(folder).iterdir() if path.is_file()}
        assert folders[f'share/mlmem_ros/{folder}'] >= shipped
    commands = {line.partition(' =')[0] for line in given['entry_points']['console_scripts']}
    assert commands == {'memory_node', 'memory_bank', 'memory_monitor', 'mlmem'}
    assert '$base/lib/mlmem_ros' in Path('setup.cfg').read_text()
