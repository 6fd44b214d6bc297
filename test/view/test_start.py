# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem view` starts a page, and a node if need be, and ends with either."""

import json
import os
import queue
import signal
import subprocess
import sys
import urllib.request
import webbrowser
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from mlmem_ros.ros import node_process
from mlmem_ros.ros.client.client import standalone
from mlmem_ros.ros.node.run import NOT_STARTED
from mlmem_tools.cli.main import main


@pytest.fixture
def run_view(monkeypatch):
    """Run `mlmem view` here: run_view(arguments, use) gives the address to a function in a thread,
    which must end the page; returns the exit status.
    """
    addresses = queue.Queue()
    monkeypatch.setattr(webbrowser, 'open', addresses.put)

    def act(use):
        try:
            use(addresses.get(timeout=60.0))
        except BaseException:
            os.kill(os.getpid(), signal.SIGTERM)
            raise

    def run(arguments, use):
        with ThreadPoolExecutor(1) as executor:
            acting = executor.submit(act, use)
            status = main(['view', *arguments, '--port', '0', '--browser'])
            acting.result()
        return status

    return run


def test_session_that_cannot_be_shown_is_rejected(tmp_path, capsys):
    assert main(['view', str(tmp_path / 'nowhere')]) == 1
    assert main(['view', 'a', 'b', 'c']) == 2
    assert main(['view', '--start', 'a']) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 3
    assert 'one of' in said[2]
    assert 'does not exist' in said[0]


def test_session_page_is_printed_and_ends_with_a_signal(run_view, capsys):
    printed = []

    def use(address):
        with urllib.request.urlopen(address, timeout=60.0) as response:
            assert response.status == 200
        printed.append(f'mlmem view: {address}\n')
        os.kill(os.getpid(), signal.SIGTERM)

    assert run_view([str(Path(__file__).parents[1] / 'data' / 'life')], use) == 0
    assert [capsys.readouterr().out] == printed


def test_page_starts_its_element_and_ends_with_it(run_view, tmp_path, monkeypatch, capsys):
    """Otherwise it would wait for a node that cannot start."""
    file = tmp_path / 'element.yaml'
    file.write_text('format: 1\nbased_on: bits_1\n', encoding='utf-8')
    processes, start = [], subprocess.Popen

    def keep(*arguments, **options):
        processes.append(start(*arguments, **options))
        return processes[-1]

    monkeypatch.setattr(subprocess, 'Popen', keep)

    def use(address):
        with urllib.request.urlopen(f'{address}about', timeout=60.0) as response:
            assert json.load(response)['live']
        with standalone('/own/one') as memory:
            memory.ready(90.0).wait()  # a busy machine starts its process late
            found = memory.parameters('element', timeout=30.0).wait()
        assert found == {'element': str(file)}
        processes[0].kill()

    assert run_view(['--start', str(file), '--node', '/own/one'], use) == 1
    told = capsys.readouterr().err.splitlines()
    assert told[-1] == 'mlmem view: its node has ended with status -9'


def test_page_of_a_node_that_cannot_start_ends(monkeypatch, capfd):
    """Its process ends before it is on the graph."""
    ends = [sys.executable, '-c', f'raise SystemExit({NOT_STARTED})']
    monkeypatch.setattr(node_process, 'run_node_process', lambda arguments: subprocess.Popen(ends))
    assert main(['view', '--start', 'bits_1', '--node', '/own/none', '--port', '0']) == 1
    told = capfd.readouterr().err
    assert told == f'mlmem view: its node has ended with status {NOT_STARTED}\n'
