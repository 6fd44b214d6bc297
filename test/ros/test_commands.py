# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands that send one request to a node, as in a shell."""

import json
import re
import signal
import subprocess
import sys
import time

import pytest
from robot import BLANK, Robot

from mlmem_ros import MemoryClient
from mlmem_ros.ros.node_process import run_child_process
from mlmem_ros.session.data import load_session
from mlmem_tools.cli.main import main


def complaint(status, told, said):
    """Return the one line with which a command gives up."""
    assert (status, told) == (1, '')
    (line,) = said.splitlines()
    return line


@pytest.fixture(scope='module')
def given():
    return {'actions': True}


@pytest.fixture
def inside(capsys):
    """Run a command in this process; return status, output and errors."""

    def run(*arguments):
        capsys.readouterr()
        return main(list(arguments)), *capsys.readouterr()

    return run


def test_commands_write_read_and_erase(memory, robot, inside):
    status, written, complaint = inside('write', '3')
    assert (status, complaint) == (0, '')
    (line,) = written.splitlines()
    assert line.startswith('wrote level 3 (code 011), echo delay ')
    assert robot.latest('level').data == 3

    status, read, complaint = inside('read')
    assert (status, complaint) == (0, '')
    delays = [float(re.search(r'delay ([\d.]+)', told)[1]) for told in (written, read)]
    assert delays[1] == pytest.approx(delays[0], abs=5.0)  # levels are 24 apart

    status, erased, complaint = inside('erase')
    assert (status, complaint) == (0, '')
    assert erased.startswith('blank')
    robot.latest('level', lambda level: level.data == BLANK)


def test_calibrate_command_prints_the_delays(memory, robot, inside, monkeypatch):
    """It is awaited, whatever a client would wait."""
    monkeypatch.setattr(MemoryClient.calibrate, '__defaults__', (0.01,))
    assert robot.write(1).success
    status, told, complaint = inside('calibrate')
    assert (status, complaint) == (0, '')
    content, heading, *rows = told.splitlines()
    assert content.startswith('level 1 (code 001), echo delay ')
    assert heading.split() == ['level', 'left', 'right']
    table = [[float(word) for word in row.split()] for row in rows]
    levels, left, right = zip(*table, strict=True)
    assert levels == tuple(range(8))
    assert left == tuple(sorted(left))
    assert right == tuple(sorted(right, reverse=True))


def test_abort_command_stops_a_write(memory, robot, inside):
    writing = robot.send('write')
    status, told, complaint = inside('abort')
    assert (status, complaint) == (0, '')
    assert told.startswith('stopped; the strain is at zero after ')
    assert robot.answer(writing) is not None


def test_record_command_begins_and_ends_a_session(robot, inside, tmp_path):
    bag = tmp_path / 'session'
    assert inside('record', str(bag)) == (0, f'recording into {bag}\n', '')
    status, told, _ = inside('record', '--stop', '--json')
    assert (status, json.loads(told)) == (0, {'recording': False, 'path': str(bag)})
    assert load_session(bag).hashes
    assert robot.get('record.path') == ''  # the path of the command is for one session
    status, told, complaint = inside('record', '--stop', '--json')
    assert status == 1
    assert 'nothing is being recorded' in json.loads(told)['error']
    assert 'nothing is being recorded' in complaint


def test_command_loads_neither_physics_nor_compiler():
    """`mlmem read` has to start fast."""
    program = (
        'import sys, mlmem_tools.cli.main as cli\n'
        'cli.main(["read", "--node", "nobody", "--wait", "0.1"])\n'
        'print(*(name for name in ("numba", "scipy", "rich", "mlmem.physics", "mlmem.memory", '
        '"mlmem.element", "mlmem.settings", "mlmem.loop") if name in sys.modules))'
    )
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, timeout=60, check=True
    )
    assert 'within 0.1 s' in done.stderr
    assert done.stdout == '\n'


def test_self_test_command_waits_for_an_abandoned_request(memory, inside):
    """The node goes on with it."""
    status, _, complaint = inside('calibrate', '--timeout', '0.01')
    assert status == 1
    assert 'did not answer calibrate within 0.01 s' in complaint
    with pytest.raises(SystemExit):
        inside('calibrate', '--timeout', '0')
    status, tested, said = inside('self_test')
    assert (status, said) == (0, '')
    lines = tested.splitlines()
    assert all(line.startswith('ok ') for line in lines)
    assert re.fullmatch(r'ok +level 7 +read', lines[-2])
    assert re.fullmatch(r'ok +restore +.*', lines[-1])


@pytest.mark.parametrize('asked', ['read', 'self_test'])
def test_command_without_a_node_says_how_to_start_one(asked, inside):
    line = complaint(*inside(asked, '--node', 'nobody', '--wait', '0.5'))
    assert '/nobody' in line
    assert '0.5 s' in line
    assert 'ros2 run mlmem_ros memory_node' in line  # what to do


def interrupt(command):
    """Press Ctrl-C until a command has ended."""
    while command.poll() is None:
        command.send_signal(signal.SIGINT)
        time.sleep(0.002)


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
        timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, '', 'mlmem read: interrupted\n')


def test_ctrl_c_while_a_command_waits_ends_it(start):
    """The command ends, once, however often it is asked to; the node finishes the write."""
    node = start(name='paused')  # nobody else may answer
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    with Robot(node.element) as robot:
        robot.pause(True)  # no answer can come
        # On a busy machine a node is not found in 5 s.
        ask = ['write', '1', '--node', node.element, '--wait', '60']
        with run_child_process('mlmem_tools.cli.main', ask, **streams) as command:
            robot.wait(lambda: node.node.waiting or command.poll() is not None, 'the request')
            assert command.poll() is None, command.stderr.read()
            interrupt(command)
            assert (command.returncode, command.stdout.read()) == (130, '')
            assert command.stderr.read() == 'mlmem write: interrupted\n'
        robot.pause(False)
        robot.latest('level', lambda level: level.data == 1)
