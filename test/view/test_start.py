# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Page and node start each other and end together."""

import json
import os
import signal
import threading
import urllib.request
from pathlib import Path

import pytest
from sampled import sampled

from mlmem_ros.ros.client.client import standalone, wait_until
from mlmem_tools.cli.main import main


def test_session_that_cannot_be_shown_is_rejected(tmp_path, capsys):
    assert main(['view', str(tmp_path / 'nowhere')]) == 1
    assert main(['view', 'a', 'b', 'c']) == 2
    assert main(['view', '--start', 'a']) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 3
    assert 'one of' in said[2]
    assert 'does not exist' in said[0]


def served(arguments, meanwhile):
    """Serve a page here until a function of a thread has returned; return its exit status."""
    over = threading.Event()

    def run():
        try:
            meanwhile(over)
        finally:
            if not over.is_set():
                os.kill(os.getpid(), signal.SIGTERM)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        return main(['view', *arguments, '--port', '0'])
    finally:
        over.set()
        thread.join()


def test_page_ends_with_the_node_that_it_started(tmp_path, capsys):
    """Without a word it would wait for a node that cannot start."""
    file = tmp_path / 'element.yaml'
    text = 'format: 1\nbased_on: case_2\nprobe: {omega_c: 2.4}'  # which fails the design check
    file.write_text(text, encoding='utf-8')
    command = ['--start', str(file), '--node', '/own/none']
    assert served(command, lambda over: over.wait(60.0)) == 1
    told = capsys.readouterr().err.splitlines()
    assert told[-1] == 'mlmem view: its node has ended with status 1'


@pytest.mark.parametrize('kind', sampled(['preset', 'file'], lambda kind: kind == 'preset'))
def test_page_starts_an_element_on_request(kind, tmp_path, capsys):
    """Of a shipped name or an element file: either is of two levels. See also the node above."""
    chosen = 'bits_1'
    if kind == 'file':
        chosen = str(tmp_path / 'element.yaml')
        Path(chosen).write_text('format: 1\nbased_on: bits_1\n', encoding='utf-8')
    found = []

    def ask(_):
        printed = []

        def has_address():
            printed.append(capsys.readouterr().out)
            return 'mlmem view: ' in ''.join(printed)

        wait_until(has_address, 'the address of the page', 60.0)
        address = ''.join(printed).partition('mlmem view: ')[2].splitlines()[0]
        with urllib.request.urlopen(f'{address}about', timeout=60.0) as response:
            assert json.load(response)['live']
        with standalone('/own/one') as memory:
            memory.ready(90.0).wait()  # a busy machine starts its process late
            found.append(memory.parameters('element', timeout=30.0).wait())

    assert served(['--start', chosen, '--node', '/own/one'], ask) == 0
    assert found == [{'element': chosen}]
