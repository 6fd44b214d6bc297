# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Warns of another node of the same name: both would answer every request."""

from __future__ import annotations

from rclpy.node import Node

from ...host import ThrottledLog
from .callback_guard import CallbackGuard

PERIOD = 0.5
"""Seconds between two checks of the graph."""

LOOKS = 10
"""Number of checks after the start: enough to discover any earlier node."""


class DuplicateNameCheck:
    """Checks the graph for some seconds after the start, and warns once."""

    def __init__(self, node: Node, log: ThrottledLog, callback_guard: CallbackGuard) -> None:
        self._node = node
        self._log = log
        self._left = LOOKS
        self._timer = callback_guard.every(PERIOD, 'the graph', self.look)

    def look(self) -> None:
        """Check the graph. An overdue timer may call again after it was destroyed."""
        if not self._left:
            return
        self._left -= 1
        own = self._node.get_name(), self._node.get_namespace()
        others = self._node.get_node_names_and_namespaces().count(own) - 1
        if others > 0:
            self._log.warning(
                f'another node named {self._node.get_fully_qualified_name()} is running, or ended '
                'less than half a minute ago without notice: while it lives both answer every '
                'request; rename one with "-r __node:=NAME" or "-r __ns:=/NAMESPACE"'
            )
            self._left = 0
        if not self._left:
            self._node.destroy_timer(self._timer)
