# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands that send one request to a node, as in a shell; `mlmem demo`."""

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from nodes import check_closed
from robot import BLANK, Robot, values
from suite import sampled

from mlmem_ros import MemoryClient
from mlmem_ros.ros import node_process
from mlmem_ros.ros.node_process import run_child_process
from mlmem_ros.session.data import load_session
from mlmem_ros.testing import NodeHere
from mlmem_tools.cli import demo, laboratory
from mlmem_tools.cli.main import main


@pytest.fixture
def run(capsys):
    """Run a command in this process: run('read') returns its exit status, output and errors."""

    def run(*arguments):
        capsys.readouterr()
        return main(list(arguments)), *capsys.readouterr()

    return run


@pytest.fixture
def output_of(run):
    """Run a command that must succeed without a complaint; return its output."""

    def output_of(*arguments):
        status, output, errors = run(*arguments)
        assert (status, errors) == (0, '')
        return output

    return output_of


def test_commands_write_read_and_erase(robot, output_of):
    outputs = output_of('write', '3'), output_of('read')
    assert outputs[0].startswith('wrote level 3 (code 011), end left, delay ')
    assert robot.latest('level').data == 3
    delays = [float(re.search(r'delay ([\d.]+)', output)[1]) for output in outputs]
    assert delays[1] == pytest.approx(delays[0], abs=5.0)  # levels are 24 apart
    assert output_of('erase').startswith('blank')
    robot.latest('level', lambda level: level.data == BLANK)


def test_kick_command_leaves_the_content_to_a_read(robot, run, output_of):
    assert robot.trigger('erase').success
    assert output_of('kick', '0.053').startswith('kicked in ')
    robot.latest('content', lambda status: values(status).get('reason') == 'kicked by hand')
    robot.latest('level', lambda level: level.data == -2)
    assert robot.trigger('read')['level'] == 3
    status, output, errors = run('kick', '0')
    assert (status, output) == (1, '')
    assert 'speed must be' in errors


def test_calibrate_command_prints_the_delays(robot, output_of, monkeypatch):
    """It is awaited, whatever a client would wait."""
    monkeypatch.setattr(MemoryClient.calibrate, '__defaults__', (0.01,))
    assert robot.write(1).success
    content, heading, *rows = output_of('calibrate').splitlines()
    assert content.startswith('level 1 (code 001), end left, delay ')
    assert heading.split() == ['level', 'left', 'right']
    table = [[float(word) for word in row.split()] for row in rows]
    levels, left, right = zip(*table, strict=True)
    assert levels == tuple(range(8))
    assert left == tuple(sorted(left))
    assert right == tuple(sorted(right, reverse=True))


def test_abort_command_stops_a_write(robot, output_of):
    writing = robot.send('write')
    assert output_of('abort').startswith('stopped; the strain is at zero after ')
    assert robot.answer(writing) is not None


def test_record_command_begins_and_ends_a_session(robot, run, output_of, tmp_path):
    bag = tmp_path / 'session'
    assert output_of('record', str(bag)) == f'recording into {bag}\n'
    ended = json.loads(output_of('record', '--stop', '--json'))
    assert ended == {'recording': False, 'path': str(bag)}
    assert load_session(bag).hashes
    assert robot.get('record.path') == ''  # the path of the command is for one session
    status, output, errors = run('record', '--stop', '--json')
    assert status == 1
    assert json.loads(output)['error'] in errors


def test_command_loads_neither_physics_nor_compiler():
    """`mlmem read` has to start fast."""
    program = (
        'import sys, mlmem_tools.cli.main as cli\n'
        'cli.main(["read", "--node", "nobody", "--wait", "0.1"])\n'
        'print(*(name for name in ("numba", "scipy", "rich", "mlmem.physics", "mlmem.memory", '
        '"mlmem.element", "mlmem.settings", "mlmem.loop") if name in sys.modules))'
    )
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=True
    )
    assert 'within 0.1 s' in done.stderr
    assert done.stdout == '\n'


def test_self_test_command_waits_for_an_abandoned_request(run, output_of):
    """The node goes on with it."""
    status, _, errors = run('calibrate', '--timeout', '0.01')
    assert (status, 'did not answer calibrate within 0.01 s' in errors) == (1, True)
    with pytest.raises(SystemExit):
        run('calibrate', '--timeout', '0')
    lines = output_of('self_test').splitlines()
    assert all(line.startswith('ok ') for line in lines)
    assert [line.split()[1] for line in lines[-2:]] == ['level', 'restore']


@pytest.mark.parametrize('command', ['read', 'self_test'])
def test_command_without_a_node_says_how_to_start_one(command, run):
    status, output, errors = run(command, '--node', 'nobody', '--wait', '0.5')
    assert (status, output, errors.count('\n')) == (1, '', 1)
    for word in ('/nobody', '0.5 s', 'ros2 run mlmem_ros memory_node'):
        assert word in errors


CTRL_C_AT = """
import os, signal, sys
moment = sys.argv.pop(1)
class Finder:
    def find_spec(self, name, *_):
        if name == moment:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from mlmem_tools.cli.main import main
sys.exit(main())
"""


@pytest.mark.parametrize('module', ['argparse', 'mlmem.procedure_table', 'rclpy'])
def test_ctrl_c_while_a_command_loads_ends_it(module):
    """In its first second; as long as Python itself starts, it is Python that ends it."""
    done = subprocess.run(
        [sys.executable, '-c', CTRL_C_AT, module, 'read'], capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, '', 'mlmem read: interrupted\n')


def test_ctrl_c_while_a_command_waits_ends_it(start):
    """The command ends, once, however often it is asked to; the node finishes the write."""
    node = start(name='paused')  # nobody else may answer
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    with Robot(node.element) as robot:
        robot.pause(True)  # no answer can come
        # On a busy machine a node is not found in 5 s.
        arguments = ['write', '1', '--node', node.element, '--wait', '60']
        with run_child_process('mlmem_tools.cli.main', arguments, **streams) as command:
            robot.wait(lambda: node.node.waiting or command.poll() is not None, 'the request')
            assert command.poll() is None, command.stderr.read()
            while command.poll() is None:
                command.send_signal(signal.SIGINT)
                time.sleep(0.002)
            assert (command.returncode, command.stdout.read()) == (130, '')
            assert command.stderr.read() == 'mlmem write: interrupted\n'
        robot.pause(False)
        robot.latest('level', lambda level: level.data == 1)


def test_command_to_two_nodes_of_one_name_warns(start, capsys):
    start(name='twin')
    assert main(['read', '--node', 'twin']) == 0
    assert capsys.readouterr().err.count('nodes of this name') == 0
    with Robot(start(name='twin').element) as robot:
        robot.wait(lambda: robot.node.count_publishers('/twin/alive') == 2, 'both')
    # A command that is answered before it has discovered the other node cannot warn.
    for _ in range(10):
        assert main(['read', '--node', 'twin', '--wait', '20']) == 0
        if warning := capsys.readouterr().err:
            break
    assert 'mlmem read: 2 nodes of this name are on the graph' in warning


@pytest.mark.parametrize(
    'levels', sampled([[1, 0], [*demo.DEMO_LEVELS]], lambda levels: levels == [1, 0])
)
def test_demo_writes_its_levels_and_records(monkeypatch, tmp_path, capfd, levels):
    """Its node runs in this process, ten times as fast as time."""

    def run_here(arguments, stdout, stderr):
        assert stdout is stderr
        assert Path(stdout.name).name == 'memory_node.log'
        return NodeHere('/mlmem', ['memory_node', *arguments, '-p', 'time.speed:=10.0'])

    monkeypatch.setattr(demo, 'DEMO_LEVELS', levels)
    monkeypatch.setattr(node_process, 'run_node_process', run_here)
    status = main(['demo', '--output', str(tmp_path)])
    printed, complaints = capfd.readouterr()
    # What a node tells, and a busy machine: a start that takes long, and time that was lost.
    known = r'^\[INFO\]|ticks of time were skipped|waits for /mlmem'
    complaints = [line for line in complaints.splitlines() if not re.search(known, line)]
    assert (status, complaints) == (0, []), printed
    rows = re.findall(r'^ *(\d) +(\d) +([01]{3}) ', printed, re.MULTILINE)
    asked = [int(asked) for asked, _, _ in rows]
    assert asked == levels
    assert [int(decoded) for _, decoded, _ in rows] == asked
    assert [int(code, 2) for _, _, code in rows] == asked
    (folder,) = tmp_path.iterdir()
    messages = check_closed(folder / 'session')
    told = [message.data for topic, _, message in messages if topic.endswith('/level')]
    assert [level for level in dict.fromkeys(told) if level >= 0] == [*dict.fromkeys(levels)]
    picture = folder / 'session.png'
    assert picture.exists() == ('session_figure' in laboratory.find_parts())
    assert not picture.exists() or picture.read_bytes().startswith(b'\x89PNG')
