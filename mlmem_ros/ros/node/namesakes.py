# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Notices that a node of the same name is there already: both would answer every request."""

from __future__ import annotations

from rclpy.node import Node

from ...host import Journal
from .boundary import Boundary

PERIOD = 0.5
"""Seconds between two looks at the graph."""

LOOKS = 10
"""How often it is looked at after the start: until then whoever was there before is discovered."""


class Namesakes:
    """Warns once, shortly after the start, if the node shares its name."""

    def __init__(self, node: Node, journal: Journal, boundary: Boundary) -> None:
        self._node = node
        self._journal = journal
        self._left = LOOKS
        self._timer = boundary.every(PERIOD, 'the graph', self.look)

    def look(self) -> None:
        """Look at the graph."""
        self._left -= 1
        own = self._node.get_name(), self._node.get_namespace()
        others = self._node.get_node_names_and_namespaces().count(own) - 1
        if others > 0:
            self._journal.warning(
                f'another node named {self._node.get_fully_qualified_name()} is there, or ended '
                'less than half a minute ago without saying so: while it lives both answer every '
                'request; give one another name with "-r __node:=NAME" or "-r __ns:=/NAMESPACE"'
            )
        if others > 0 or not self._left:
            self._node.destroy_timer(self._timer)
