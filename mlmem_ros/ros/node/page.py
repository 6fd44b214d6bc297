# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of an element, in a process of its own that ends with the node."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rclpy.node import Node

PATIENCE = 5.0
"""Longest wait in seconds for the end of the server."""


@contextmanager
def page(node: Node) -> Iterator[None]:
    """Serve the page of a node, if its parameter `view` says so; the server prints its address.

    Args:
        node: A memory node.
    """
    if not node.get_parameter('view').value:
        yield
        return
    name = node.get_fully_qualified_name()
    command = [sys.executable, '-m', 'mlmem_ros.cli.main', 'view', '--until-eof', '--node', name]
    process = subprocess.Popen(command, stdin=subprocess.PIPE)  # it ends with us, however we end
    try:
        yield
    finally:
        try:
            process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
