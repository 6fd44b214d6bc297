# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a node has but does not list: those of a preset that a robot leaves alone.

A list of 170 parameters hides the twenty that a robot builder changes. The others come with the
preset or a parameter file. By name they are told and set like any; what was set is listed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.node import Node
from rclpy.parameter import Parameter

from .declarations import DIGEST

if TYPE_CHECKING:
    from .parameters import ParameterSet


class UnlistedParameters(Node):
    """A node with such parameters; rclpy's services of parameters call these methods."""

    known: ParameterSet | None = None

    def list_parameters(self, prefixes: list[str], depth: int) -> Any:
        """Return the names of parameters that are listed, and their prefixes."""
        found = super().list_parameters(prefixes, depth)
        if self.known is not None:
            found.names = [name for name in found.names if name not in self.known.hidden]
            found.prefixes = sorted({n.rpartition('.')[0] for n in found.names if '.' in n})
        return found

    def get_parameter(self, name: str) -> Any:
        """Return a parameter; the digest is that of the present values."""
        if name == DIGEST and self.known is not None:
            return Parameter(name, value=self.known.digest())
        return super().get_parameter(name)
