# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Memory nodes for tests, and emulated rigs for these."""

import contextlib
import subprocess
import sys

import pytest

from mlmem_ros import RequestRefused
from mlmem_ros.ros import node_process
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.node_process import run_child_process
from mlmem_ros.testing import memory_node

SOON = 30.0
"""Seconds to wait for what comes at once: a machine may be busy."""

STREAMS = ('field', 'wall', 'joint_states', 'image', 'markers')
QUICK = {
    'design.preset': 'case_2', 'write.method': 'kick', 'design.check': 'skip',
    'scale.time': 1e-5, 'actions': False,
    **{f'publish.{stream}_every': 100 for stream in STREAMS},
}  # fmt: skip
"""What a node is given unless a test says otherwise: the preset of a robot written by kicks, ten
times as fast, with a hundred messages a second of each stream,
unchecked and without actions."""

LINE = ('--latency', '0.002', '--jitter', '0.003', '--loss', '0.002', '--drift', '1e-4')
"""A rig up to 5 ms away, which loses frames and has its own clock."""

SHARED = set[str]()
"""The elements of nodes that the tests of a module share."""


def program(*command, **streams):
    """Start `python COMMAND ...`, forked like nodes from a process that has loaded all."""
    return node_process.subprocess.Popen([sys.executable, *map(str, command)], **streams)


def hears(process, word):
    """Read the output of a process up to a line; Fast DDS may print its complaints there, too."""
    assert f'{word}\n' in iter(process.stdout.readline, ''), f'it ended before it said {word}'


@contextlib.contextmanager
def emulated_rig(*options):
    """Run an emulated rig in its own process; yield its address."""
    command = ['rig', *options]
    with run_child_process(
        'mlmem_tools.cli.main', command, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process.stdout.readline().strip()


@contextlib.contextmanager
def starting(driver='sim', shared=False):
    """Yield a function that starts a node, with its own rig if need be; all end with the block."""
    with contextlib.ExitStack() as nodes:

        def start(parameters=None, **options):
            given = {**QUICK, **(parameters or {})}
            if driver == 'rig':
                made = '--preset', given['design.preset'], '--scale-time', str(given['scale.time'])
                address = nodes.enter_context(emulated_rig(*made, *LINE))
                given |= {
                    'device.driver': 'rig',
                    'device.address': f'{address}?lead=0.2&patience=10',
                }
            node = nodes.enter_context(memory_node(given, **options))
            assert shared or node.element not in SHARED, f'two nodes answer as {node.element}'
            if shared:
                SHARED.add(node.element)
                nodes.callback(SHARED.discard, node.element)
            return node

        yield start


def arrived(memory, waiting=0):
    """Step until a procedure runs and so many wait: a step alone may overtake a request."""
    asked = memory.node.host.loop._asked
    stepped(memory, lambda: asked._open and len(asked.waiting) == waiting, f'{waiting} that wait')


def refused(memory, reply, why):
    """A request is refused in the tick in which it arrives."""
    stepped(memory, reply.done, 'the refusal')
    with pytest.raises(RequestRefused, match=why):
        reply.wait()


def stepped(memory, condition, what):
    """Step, while time is paused, until a condition holds."""
    wait_until(lambda: memory.memory.step().wait() and condition(), what, SOON)
