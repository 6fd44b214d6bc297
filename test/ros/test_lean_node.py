# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node imports: only what it uses."""

import json
import subprocess
import sys

import pytest

NODE = """
import json, sys
from mlmem_ros.ros.main import parse_node_arguments
from mlmem_ros.ros.node.run import end_nodes, start_nodes
nodes, executor = start_nodes(parse_node_arguments(['memory_node', *sys.argv[1:]]))
assert nodes[0].host.loop is not None
ours = [name for name in sys.modules if name.partition('.')[0] in ('mlmem_ros', 'mlmem_tools')]
print(json.dumps({name: sys.modules[name].__file__ for name in ours}))
end_nodes(nodes, executor)
"""
"""A node until it is active."""


@pytest.fixture(scope='module')
def imported():
    """Files by module that an active node has imported, its design known to be good."""
    command = [sys.executable, '-c', NODE, '--ros-args', '-p', 'design.check:=skip']
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    'part',
    [f'mlmem_ros.{part}' for part in ('bag.reader', 'rig', 'ros.client', 'session', 'testing')]
    + ['mlmem_tools'],
)
def test_node_does_not_import_what_it_does_not_use(imported, part):
    assert not [name for name in imported if f'{name}.'.startswith(f'{part}.')]
