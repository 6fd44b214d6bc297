# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Memory nodes for tests, emulated rigs for these, and their closed bags."""

import contextlib
import hashlib
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import yaml
from mcap.reader import make_reader
from rclpy.task import Future
from rosbags.highlevel import AnyReader
from suite import TIMEOUT_S

from mlmem import Settings, load_element
from mlmem.element_file import ELEMENT_NAMES
from mlmem.physics import CASE_II
from mlmem.schema import find_descriptions
from mlmem_ros.host.settings import declare_parameters
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.node_process import run_child_process
from mlmem_ros.testing import frozen_clock, memory_node

FOLDER = TemporaryDirectory(prefix='mlmem-elements-')
"""Where the element files of the tests are."""

IN_ELEMENT_FILES = {
    f'{group}.{field.name}'
    for group, owner in {'design': CASE_II, **Settings().list_groups()}.items()
    for field, _ in find_descriptions(owner)
} - {name for name, *_ in declare_parameters()}
"""Values that belong to an element."""


def element_file(based_on, values, folder=FOLDER.name):
    """Return the path of a new file in a folder with a shipped element, changed:
    element_file('case_2', {'scale.time': 1e-5}).
    """
    groups = {'format': 1, 'based_on': based_on}
    for name, value in values.items():
        group, _, key = name.partition('.')
        groups.setdefault(group, {})[key] = value
    text = yaml.safe_dump(groups)
    path = Path(folder, f'{based_on}_{hashlib.blake2b(text.encode()).hexdigest()[:8]}.yaml')
    path.write_text(text, encoding='utf-8')
    return str(path)


def node_parameters(given):
    """Return the parameters of a node, given those and values of its element such as `scale.time`;
    the latter go into a file, based on the shipped element of `element`.
    """
    kept = dict(given)
    own = {name: kept.pop(name) for name in given if name in IN_ELEMENT_FILES}
    if own and (element := kept.get('element', 'case_2')) in ELEMENT_NAMES:
        kept['element'] = element_file(element, own, kept.get('files.root', FOLDER.name))
    return kept


QUICK = {
    'element': 'case_2', 'write.method': 'kick', 'design.check': 'skip',
    'scale.time': 1e-5, 'actions': False,
    **{f'publish.{stream}_every': 100 for stream in ('field', 'wall', 'joint_states', 'views')},
}  # fmt: skip
"""What `node_parameters` is given unless a test says otherwise: the element of a robot written by
kicks, ten times as fast, with a hundred messages a second of each stream, unchecked and without
actions.
"""

TICK = load_element(QUICK['element']).settings.time.tick * QUICK['scale.time']
"""Seconds."""

LINE = ('--latency', '0.002', '--jitter', '0.003', '--loss', '0.002', '--drift', '1e-4')
"""A rig up to 5 ms away, which loses frames and has its own clock."""

SHARED = set[str]()
"""The elements of nodes that the tests of a module share."""


def run_in_executor(node, executor, action):
    """Run an action as a timer's callback of a node in an executor; return what it returns."""
    done = Future()

    async def callback():
        timer.cancel()
        try:
            done.set_result(await action())
        except Exception as error:
            done.set_exception(error)

    timer = node.create_timer(0.001, callback)
    executor.add_node(node)
    executor.spin_until_future_complete(done, TIMEOUT_S)
    node.destroy_timer(timer)
    assert done.done(), f'no answer within {TIMEOUT_S} s: a deadlock'
    return done.result()


def program(*command, **streams):
    """Start `python COMMAND ...`."""
    return subprocess.Popen([sys.executable, *map(str, command)], **streams)


@contextlib.contextmanager
def emulated_rig(*options):
    """Run an emulated rig in its own process; yield its address."""
    streams = {'stdout': subprocess.PIPE, 'text': True}
    with run_child_process('mlmem_tools.cli.main', ['rig', *options], **streams) as process:
        yield process.stdout.readline().strip()


@contextlib.contextmanager
def run_nodes(driver='sim', shared=False):
    """Yield a function that starts a node, with its own rig if need be; all end with the block."""
    with contextlib.ExitStack() as nodes:

        def start(changed=None, **options):
            given = node_parameters({**QUICK, **(changed or {})})
            if driver == 'rig':
                address = nodes.enter_context(emulated_rig('--element', given['element'], *LINE))
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


def check_node(node, element):
    """A node of `memory_node` has its name, parameters and log; its time may be frozen."""
    assert (node.element, node.memory.name) == (element, element)
    found = node.memory.parameters('write.method', timeout=TIMEOUT_S).wait()  # it starts
    assert found == {'write.method': 'kick'}
    with frozen_clock(node) as clock:
        before = node.memory.pause().wait().tick
        assert clock.finish(node.memory.write(0)).level == 0
        assert node.memory.pause().wait().tick - before == clock.ticks
        assert clock.ticks * TICK == pytest.approx(clock.now - 1.0)
    assert node.memory.read().wait().level == 0  # time runs again
    assert 'ready: 8 levels' in node.output
    assert node.running


def end_node(node):
    """Terminate a node, which must end well."""
    node.terminate()
    assert node.exit_status() == 0


def check_closed(bag):
    """Assert that a bag of one file is whole, by readers that share no code with our writer.

    Return its messages: topic, time, message.
    """
    (file,) = bag.glob('*.mcap')
    with file.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None  # which is written last
        in_file = sum(1 for _ in reader.iter_messages())
    with AnyReader([bag]) as reader:
        messages = [
            (connection.topic, time, reader.deserialize(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]
        in_metadata = reader.message_count
        times = [time for _, time, _ in messages]
        assert (reader.start_time, reader.end_time - 1) == (min(times), max(times))
    assert {summary.statistics.message_count, in_file, in_metadata} == {len(messages)}
    return messages


def step_until_arrived(memory, waiting=0, unless=lambda: False):
    """Step until a procedure runs and so many wait: a step alone may overtake a request.

    A request whose deadline comes may have left again: `unless` says so.
    """
    asked = memory.node.host.loop._asked

    def has_arrived():
        return unless() or (asked._open and len(asked.waiting) == waiting)

    wait_until(
        lambda: memory.memory.step().wait() and has_arrived(), f'{waiting} that wait', TIMEOUT_S
    )
