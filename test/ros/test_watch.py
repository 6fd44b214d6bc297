# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem watch`: its picture, and the command in its own terminal."""

import contextlib
import fcntl
import io
import os
import pty
import re
import select
import struct
import termios
import time

import pytest
from nodes import program
from rich.console import Console

from mlmem_tools.cli.dashboard import SPARKS, dashboard, sparkline
from mlmem_tools.cli.main import main
from mlmem_tools.cli.watch import complete
from mlmem_tools.view.monitor import Status, View

WATCH = """
import fcntl, os, sys, termios
os.setsid()
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
sys.argv[1:] = ['watch']
from mlmem_tools.cli.main import main
sys.exit(main())
"""
"""`mlmem watch` in a terminal of its own."""


def picture(width=100, **heard):
    """Return the picture of Case II as lines of plain text."""
    view = View('/mlmem', cells=225, period=25, max_strain=0.08)
    for name, value in heard.items():
        setattr(view, name, value)
    console = Console(file=io.StringIO(), width=width, force_terminal=False)
    console.print(dashboard(view, width))
    return console.file.getvalue().splitlines()


def row(label, **heard):
    """Return what stands beside a label."""
    (line,) = [line for line in picture(**heard) if line.startswith(f'│ {label} ')]
    return line.removeprefix(f'│ {label} ').rstrip('│ ').lstrip()


def written(level, **values):
    texts = {'procedure': 'write', 'level': str(level), 'code': format(level, '03b'), **values}
    return Status(0, 'write succeeded', texts)


# The picture


def test_nothing_heard_yet():
    lines = picture()
    assert '/mlmem' in lines[0]
    assert row('level') == 'not read yet'
    assert row('rates') == 'no report yet'


def test_level_and_code():
    assert row('level', level=5, outcome=written(5)).split() == ['5', '101']
    assert row('level', level=3, outcome=written(5)) == '3'  # that code was another level's
    assert row('level', level=-1) == 'blank'
    assert row('level', level=-2) == 'unknown'


def test_the_wall_is_drawn_where_it_is():
    for site in (1.0, 100.0, 225.0):
        chain = row('chain', walls=[site])
        assert chain.count('┃') == 1
        assert chain.index('┃') == pytest.approx(site / 225 * len(chain), abs=1.0)
    ticks = row('chain', walls=[]).count('┿')
    assert ticks == 8  # one at every level
    assert 'wall at 100.00, 150.00 of 225 cells' in '\n'.join(picture(walls=[100.0, 150.0]))
    assert 'no wall' in '\n'.join(picture(walls=[]))


def test_strain_to_either_side():
    pressed, pulled = row('strain', strain=-0.04), row('strain', strain=0.04)
    assert pressed.endswith('-0.0400')
    assert pressed.index('━') < pressed.index('│') < pulled.index('━') + len(pressed)
    assert pulled.index('│') < pulled.index('━')
    assert pressed.count('━') == pulled.count('━') > 10
    assert '━' not in row('strain', strain=0.0)
    assert row('strain', strain=9.0).count('━') > 30  # no wider than the panel


def test_echo():
    assert sparkline([0.0, 1.0, 0.0, 0.25], 4) == ' █ ▄'
    assert sparkline([0.0] * 7, 5) == '     '
    assert sparkline([], 3) == '   '
    narrow = sparkline([0.0, 0.1, 0.9, 1.0] * 50, 10)
    assert (len(narrow), set(narrow)) == (10, {SPARKS[-1]})  # every peak survives


def test_how_the_last_procedure_ended():
    assert 'level 5, delay 690.5' in row('last', outcome=written(5, delay='690.5'))
    failed = Status(2, 'aborted', {'procedure': 'write'})
    assert row('last', outcome=failed) == 'write failed: aborted'


def test_rates_and_health():
    values = {'rate': '500', 'overruns': '3', 'lateness_mean': '0.0001', 'busy': '0.0002'}
    values['lateness_deviation'] = '0.0001'
    health = {'loop': Status(1, '3 ticks were skipped', values), 'memory': Status(0, 'blank', {})}
    assert row('rates', health=health).startswith('500.0 ticks/s, 3 overruns, late 0.10')
    assert row('loop', health=health) == '● 3 ticks were skipped'
    assert row('memory', health=health) == '● blank'


def test_a_silent_node():
    assert 'listening' in picture()[-1]
    assert 'silent for 7 s' in picture(last_message=time.monotonic() - 7.2)[-1]


@pytest.mark.parametrize('width', [20, 48, 80, 300])
def test_it_fits(width):
    lines = picture(
        width, level=1, walls=[50.0], strain=0.01, echo=[1.0] * 999, outcome=written(1)
    )
    assert len({len(line) for line in lines if line.startswith(('│', '╭', '╰'))}) == 1
    assert all(len(line) <= max(48, width) for line in lines)


# The command


class Terminal:
    """A terminal of 100 columns in which a command runs."""

    def __init__(self):
        self._own, other = pty.openpty()
        fcntl.ioctl(other, termios.TIOCSWINSZ, struct.pack('HHHH', 30, 100, 0, 0))
        self.process = program(
            '-c', WATCH, stdin=other, stdout=other, stderr=other,
            env={**os.environ, 'TERM': 'xterm-256color'},
        )  # fmt: skip
        os.close(other)
        self.shown = ''

    def wait_for(self, pattern, within=20.0):
        """Read until the screen has shown a pattern since the last one."""
        deadline, begin = time.monotonic() + within, len(self.shown)
        while not re.search(pattern, self.shown[begin:]):
            remaining = deadline - time.monotonic()
            assert remaining > 0.0, f'no {pattern!r} within {within:g} s:\n{self.shown[-3000:]}'
            self._read(remaining)

    def type(self, keys):
        os.write(self._own, keys.encode())

    def exit_status(self, within=20.0):
        deadline = time.monotonic() + within
        while self.process.poll() is None and time.monotonic() < deadline:
            self._read(0.1)
        return self.process.wait(0.1)

    def _read(self, timeout):
        if select.select([self._own], [], [], timeout)[0]:
            with contextlib.suppress(OSError):  # its other end is closed
                self.shown += os.read(self._own, 65536).decode(errors='replace')

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self._own)


def test_a_running_element_is_shown_until_ctrl_c(robot):
    robot.write(2)
    with contextlib.closing(Terminal()) as terminal:
        terminal.wait_for(r'wall at 2[67]\.\d\d of 135 cells')
        terminal.wait_for(r'ticks/s')
        robot.write(6)
        terminal.wait_for(r'wall at 6[23]\.\d\d of 135 cells')
        terminal.wait_for(r'█')  # the echo
        terminal.type('\x03')
        assert terminal.exit_status() == 0
        assert 'Traceback' not in terminal.shown
        assert '\x1b[?25h' in terminal.shown  # the cursor is back


def test_one_picture(robot, memory, capsys):
    level = robot.write(1)['level']
    assert main(['watch', '--once']) == 0
    assert re.search(rf'level +{level} +001', capsys.readouterr().out)


def test_a_picture_waits_for_the_level_that_a_report_speaks_of():
    view = View('/mlmem', cells=225, period=25, max_strain=0.08)
    assert not complete(view)
    view.health = {'memory': Status(0, 'not read yet', {})}
    assert complete(view)
    view.health = {'memory': Status(0, 'level 1', {'level': '1'})}
    assert not complete(view)
    view.level = 1
    assert complete(view)


def test_a_missing_node_is_reported(capsys):
    assert main(['watch', '--node', 'nobody', '--wait', '0.2']) == 1
    line = 'mlmem watch: no memory node answers as /nobody within 0.2 s'
    assert capsys.readouterr().err.startswith(line)
