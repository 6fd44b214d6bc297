# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of an element, in a process of its own that ends with the node."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

from rclpy.node import Node

from ..node_process import child


def page(node: Node) -> AbstractContextManager[Any]:
    """Serve the page of a node, if its parameter `view` says so; the server prints its address.

    Args:
        node: A memory node.
    """
    if not node.get_parameter('view').value:
        return nullcontext()
    return child('mlmem_ros.cli.main', ['view', '--node', node.get_fully_qualified_name()])
