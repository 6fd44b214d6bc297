# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element in a robot's own program, in each of rclpy's executors; a client in C++."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from nodes import QUICK, node_parameters, program, run_in_executor
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from suite import TIMEOUT_S

from mlmem import SettingsError
from mlmem_ros import MemoryClient, MemoryNode, RequestRefused
from mlmem_ros.contract import requests
from mlmem_ros.host import store
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.middleware import create_events_executor
from mlmem_ros.ros.node_process import PROFILE_VARIABLES


@pytest.mark.parametrize(
    'kind', [SingleThreadedExecutor, MultiThreadedExecutor, create_events_executor]
)
def test_element_and_robot_share_an_executor(context, create_node, kind, tmp_path):
    state, executor = tmp_path / 'element.json', kind(context=context)
    given = node_parameters({**QUICK, 'state.path': str(state)})
    robot = create_node('robot')
    client = MemoryClient(robot, '/arm/mlmem')
    with MemoryNode(parameters=given, namespace='arm', context=context) as memory:
        executor.add_node(memory)
        assert run_in_executor(robot, executor, lambda: client.write(3)).level == 3
        assert run_in_executor(robot, executor, client.read).level == 3

        host = memory.host
        host.open_loop().call(lambda: setattr(host.element, 'advance', None))
        # The executor looks after its device.
        wait_until(lambda: executor.spin_once(0.1) or host.element is None, 'its end', TIMEOUT_S)
        with pytest.raises(RequestRefused, match='the device has stopped'):
            run_in_executor(robot, executor, client.read)
    assert memory not in executor.get_nodes()
    assert store.load_snapshot(state)['reading']['level'] == 3
    executor.shutdown()


PROGRAM = f"""
import time
import rclpy
from rclpy.executors import SingleThreadedExecutor
from mlmem_ros import MemoryClient, MemoryNode

async def remember():
    assert (await client.write(3)).level == 3
    assert (await client.read()).level == 3

QUICK = {node_parameters(QUICK)}
rclpy.init()
robot, executor = rclpy.create_node('robot'), SingleThreadedExecutor()
executor.add_node(robot)
client = MemoryClient(robot)
with MemoryNode(parameters=QUICK) as memory:
    executor.add_node(memory)
    task = executor.create_task(remember)
    executor.spin_until_future_complete(task, 60.0)
task.result()
assert task.done()
executor.shutdown()

reply = MemoryClient(robot, '/nobody').ready(60.0)
node = reply.link.thread.node
destroy = node.destroy_node

def destroy_late():
    time.sleep(0.5)
    destroy()
    print('left')

node.destroy_node = destroy_late
rclpy.try_shutdown()
while not reply.done():
    time.sleep(0.001)
"""


def test_program_of_robot_and_element_ends_as_its_client_left():
    """By default Fast DDS hands over messages within one process; our other tests have it send
    them. A client's thread that Python's end stopped in C++ would end the process by SIGABRT.
    """
    by_default = {name: os.environ[name] for name in os.environ.keys() - PROFILE_VARIABLES}
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE}
    done = program('-c', PROGRAM, env=by_default, text=True, **pipes)
    output, errors = done.communicate(timeout=TIMEOUT_S)
    assert (output, done.returncode) == ('left\n', 0), errors


def test_node_that_cannot_start_leaves_nothing_behind(context, create_node):
    robot = create_node('robot')
    with (
        pytest.raises(SettingsError, match='element'),
        MemoryNode(parameters={'element': 'case_9'}, context=context),
    ):
        pass
    assert 'mlmem' not in robot.get_node_names()
    with MemoryNode(parameters={'autostart': False}, context=context) as memory:
        assert memory.unconfigured


def test_cpp_client_writes_and_reads_a_level(start, tmp_path):
    if not requests.load_action_types():
        pytest.skip('mlmem_interfaces is not built: make interfaces')
    prefixes = filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep))
    if not any(Path(each, 'share', 'rclcpp_action').is_dir() for each in prefixes):
        pytest.skip('there is no rclcpp_action: wheels do not have it, apt does')
    if shutil.which('cmake') is None or shutil.which('c++') is None:
        pytest.skip('there is no cmake or no C++ compiler')
    example = Path(__file__).parents[2] / 'examples' / 'cpp_client'
    subprocess.run(['cmake', '-S', example, '-B', tmp_path], check=True)
    subprocess.run(['cmake', '--build', tmp_path], check=True)
    start()
    client = [tmp_path / 'client', '3']
    done = subprocess.run(client, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert 'level 3' in done.stderr
