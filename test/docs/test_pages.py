# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The code and commands of README, tutorials and guides work as printed, from top to bottom, as a
reader runs them; notebooks and the reference of files follow the code.

`python` is executed, in one namespace for the page; tests are given to pytest.
`console` is run by a shell, a command after each `$`; `...` in the output stands for anything.
`&` leaves a memory node running, ten times faster, until the page ends, or `kill %memory_node`.
`ros2` is skipped where it is missing. `sh` and `text` are not run.
"""

import contextlib
import dataclasses
import doctest
import io
import json
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import notebooks
import numpy as np
import pytest
from markdown_it import MarkdownIt

from mlmem import Settings, element_file
from mlmem.schema import find_descriptions
from mlmem_ros.session import records
from mlmem_ros.testing.running import NodeHere
from mlmem_tools.cli.main import main

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / 'README.md',
    ROOT / 'docs' / 'build_one.md',
    ROOT / 'docs' / 'design.md',
    ROOT / 'docs' / 'faults.md',
    *sorted(notebooks.TUTORIAL_FOLDER.glob('*.md')),
]
SLOW = ('own_element',)
"""Pages with a fit."""

DECLARATIONS = {
    '### `~/session`': records.Header,
    '### `~/session/state_hash`': records.StateHash,
    '## Element': element_file._File,
}
"""What is read, and so what is written, by its heading on the page on files."""

RESERVOIR_RESULTS = {
    0.0: ((39.1, 0.30), (40.9, 0.50)),
    0.01: ((39.9, 0.34), (39.8, 0.51)),
}
"""Linear memory and NARMA2 error by scatter: blank, and with a wall at level 3."""


def list_blocks(path):
    """Return every fenced block of a page: language, text, line of its first line."""
    return [
        (token.info.strip(), token.content, token.map[0] + 2)
        for token in MarkdownIt().parse(path.read_text(encoding='utf-8'))
        if token.type == 'fence'
    ]


def list_code(name):
    """Return the Python blocks of a tutorial."""
    path = notebooks.TUTORIAL_FOLDER / f'{name}.md'
    return [text for language, text, _ in list_blocks(path) if language == 'python']


class Page:
    """A page that is run in the present folder."""

    def __init__(self, path):
        self.path = path
        self.names = {'__name__': '__page__'}
        self.nodes = contextlib.ExitStack()
        self.tests = []  # consecutive ones, for one run of pytest

    def run(self):
        """Run all blocks, each test with those that follow it."""
        with self.nodes:
            for language, text, line in list_blocks(self.path):
                if language == 'python' and re.search(r'^def test_', text, re.MULTILINE):
                    self.tests.append(text)
                    continue
                self.run_tests()
                if language == 'python':
                    code = compile('\n' * (line - 1) + text, str(self.path), 'exec')
                    exec(code, self.names)
                elif language == 'console':
                    for part in re.split(r'^\$ ', text, flags=re.MULTILINE)[1:]:
                        command, _, expected = part.partition('\n')
                        self.run_command(command, expected)
            self.run_tests()

    def run_tests(self):
        if not self.tests:
            return
        file = Path(f'test_{self.path.stem}.py')  # a unique name: Python caches modules by name
        file.write_text('\n\n'.join(self.tests))
        self.tests.clear()
        options = ['-q', '-p', 'no:cacheprovider', '-c', os.devnull, '--rootdir', '.']
        own = ['--import-mode=importlib', '--assert=plain']  # our modules are imported already
        assert pytest.main([*options, *own, str(file)]) == 0

    def run_command(self, command, expected):
        """Run a command, `mlmem` in this process; its output must be the page's."""
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
        printed = io.StringIO()
        if words[0] == 'mlmem':
            command, _, otherwise = command.partition(' || ')
            with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
                failed = main(shlex.split(command)[1:])
            command = otherwise if failed else ''
            assert command or not failed, printed.getvalue()
        done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, f'{command}: exit status {done.returncode}\n{done.stderr}'
        told = printed.getvalue() + done.stdout + done.stderr
        lenient = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
        found = not expected or doctest.OutputChecker().check_output(expected, told, lenient)
        assert found, f'{command} printed\n{told}\nnot\n{expected}'


@pytest.mark.parametrize(
    'path',
    [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in SLOW)) for path in PAGES],
    ids=lambda path: path.stem,
)
def test_page_works_as_printed(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # A study then runs in this process: to start others takes longer than what they do.
    monkeypatch.setattr(os, 'sched_getaffinity', lambda process: {0}, raising=False)
    Page(path).run()


def test_page_on_files_lists_keys_versions_and_topics():
    text = (ROOT / 'docs' / 'reference' / 'files.md').read_text(encoding='utf-8')
    groups = Settings().list_groups()
    for heading, kind in DECLARATIONS.items():
        section = text.partition(f'{heading}\n')[2].partition('\n#')[0]
        listed = dict(re.findall(r'^- `(\w+)`: (.+)', section, re.MULTILINE))
        declared = {field.name for field in dataclasses.fields(kind)} - groups.keys()
        assert listed.keys() == declared, heading
        for field, description in find_descriptions(kind):
            if field.name == 'format':
                assert listed['format'].endswith(f' {description.high}'), heading
    assert all(f'- `~/{topic}`: ' in text for topic in records.SessionTopic)


@pytest.mark.parametrize('name', notebooks.NOTEBOOK_NAMES)
def test_notebook_has_the_code_of_its_page(name, tmp_path):
    notebooks.write_notebooks(tmp_path)
    notebook = json.loads((tmp_path / f'{name}.ipynb').read_text())
    code = [cell['source'] for cell in notebook['cells'] if cell['cell_type'] == 'code']
    assert code == [text.strip() for text in list_code(name)]
    assert notebook['nbformat'] == 4
    assert not any('```python' in cell['source'] for cell in notebook['cells'])


@pytest.mark.slow
@pytest.mark.parametrize('scatter', RESERVOIR_RESULTS)
def test_reservoir_of_full_size_has_the_printed_table(scatter):
    """Tolerances are about the standard deviation between seeds: another BLAS rounds otherwise."""
    names = {}
    for text in list_code('reservoir')[:3]:
        exec(text, names)
    blank, wall, swapped = [], [], []
    for seed in range(3):
        memory, error, readout = names['measure'](None, seed, scatter)
        blank.append((memory, error))
        wall.append(names['measure'](3, seed, scatter)[:2])
        swapped.append(names['measure'](3, seed, scatter, weights=readout)[1])
    assert min(swapped) > 1.0
    for found, printed in zip((blank, wall), RESERVOIR_RESULTS[scatter], strict=True):
        memory, error = np.mean(found, axis=0)
        assert memory == pytest.approx(printed[0], abs=2.0)
        assert error == pytest.approx(printed[1], abs=0.05)
