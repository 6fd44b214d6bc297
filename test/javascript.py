# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""JavaScript of the pages, run by Node.js where it is installed: no browser is needed."""

import json
import shutil
import subprocess

import pytest

NODE = shutil.which('node')

needs_node = pytest.mark.skipif(NODE is None, reason='needs Node.js')


def run_module(source, *arguments):
    """Return what a module prints as a list of values, one JSON text per line.

    Args:
        source: Its text; it imports files by their addresses (`Path.as_uri`).
        *arguments: `process.argv` from 1 on.
    """
    # A process whose compiler has threads may wait for ever for them at its end (node 54918).
    command = [NODE, '--single-threaded', '--input-type=module', '-e', source, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]
