# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Run a page of the documents: its Python and its commands, from top to bottom, as a reader does.

`python` is executed, in one namespace for the page; tests are given to pytest.
`console` is run by a shell, a command after each `$`; `...` in the output stands for anything.
`&` leaves a memory node running, ten times faster, until the page ends, or `kill %memory_node`.
`ros2` is skipped where it is missing. `sh` and `text` are not run.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from markdown_it import MarkdownIt

from mlmem_ros.testing.running import NodeHere
from mlmem_tools.cli.main import main as mlmem

PATIENCE = 60.0
"""Seconds that a command of a page may take."""


def blocks(path: Path) -> Iterator[tuple[str, str, int]]:
    """Yield every fenced block of a page: language, text, line of its first line."""
    for token in MarkdownIt().parse(path.read_text(encoding='utf-8')):
        if token.type == 'fence' and token.map:
            yield token.info.strip(), token.content, token.map[0] + 2


class Page:
    """A page that is run."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.names: dict[str, Any] = {'__name__': '__page__'}
        self.nodes = contextlib.ExitStack()

    def run(self) -> None:
        """Run all its blocks in the present folder.

        Raises:
            AssertionError: A command fails, or its output is not the page's.
        """
        tests: list[str] = []  # consecutive ones, for one run of pytest
        with self.nodes:
            for language, text, line in blocks(self.path):
                if language == 'python' and re.search(r'^def test_', text, re.MULTILINE):
                    tests.append(text)
                    continue
                self._tests(tests)
                if language == 'python':
                    code = compile('\n' * (line - 1) + text, str(self.path), 'exec')
                    exec(code, self.names)
                elif language == 'console':
                    for command, expected in commands(text):
                        self._command(command, expected)
            self._tests(tests)

    def _tests(self, tests: list[str]) -> None:
        if not tests:
            return
        file = Path(f'test_{self.path.stem}.py')  # a unique name: Python caches modules by name
        file.write_text('\n\n'.join(tests))
        tests.clear()
        options = ['-q', '-p', 'no:cacheprovider', '-c', os.devnull, '--rootdir', '.']
        own = ['--import-mode=importlib', '--assert=plain']  # our modules are imported already
        assert pytest.main([*options, *own, str(file)]) == 0

    def _command(self, command: str, expected: str) -> None:
        words = shlex.split(command)
        if words[0] == 'memory_node' and words[-1] == '&':
            faster = [*words[:-1], '--ros-args', '-p', 'time.speed:=10.0']
            self.nodes.enter_context(NodeHere('/mlmem', faster))
            return
        if command == 'kill %memory_node':
            self.nodes.close()
            return
        if words[0] == 'ros2' and not shutil.which('ros2'):
            return
        status, printed = run(command)
        assert status == 0, f'{command}: exit status {status}\n{printed}'
        assert matches(printed, expected), f'{command} printed\n{printed}\nnot\n{expected}'


def run(command: str) -> tuple[int, str]:
    """Run `mlmem` in this process and other commands in a shell; return exit status and output."""
    words = shlex.split(command)
    if words[0] == 'mlmem' and not set(words) & {'|', '||', '>'}:
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return mlmem(words[1:]), said.getvalue()
    ours = os.pathsep.join((str(Path(sys.executable).parent), os.environ['PATH']))
    done = subprocess.run(
        command, shell=True, capture_output=True, text=True, timeout=PATIENCE,
        env={**os.environ, 'PATH': ours},
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def commands(text: str) -> Iterator[tuple[str, str]]:
    """Yield every command of a block with its output as the page shows it."""
    for part in re.split(r'^\$ ', text, flags=re.MULTILINE)[1:]:
        command, _, expected = part.partition('\n')
        yield command, expected


def matches(printed: str, expected: str) -> bool:
    """Return whether an output is as expected, apart from spaces at the ends of lines."""
    checker = doctest.OutputChecker()
    return not expected or checker.check_output(plain(expected), plain(printed), doctest.ELLIPSIS)


def plain(text: str) -> str:
    return '\n'.join(line.rstrip() for line in text.strip().splitlines())
