# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a node knows but does not list: those of a preset that a robot leaves alone.

A list of 170 parameters hides the twenty that a robot builder changes. The others come with the
preset or a parameter file. By name they are told and set like any; what was set is listed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

if TYPE_CHECKING:
    from .parameters import ParameterSet


class UnlistedParameters(Node):
    """A node with such parameters; rclpy's services of parameters call these methods."""

    known: ParameterSet | None = None

    def get_parameter(self, name: str) -> Any:
        """Return a parameter, listed or not."""
        told = self.known.told(name) if self.known is not None else None
        return told[0] if told is not None else super().get_parameter(name)

    def get_parameter_type(self, name: str) -> Any:
        """Return the type of a parameter, listed or not."""
        told = self.known.told(name) if self.known is not None else None
        return told[0].type_.value if told is not None else super().get_parameter_type(name)

    def describe_parameter(self, name: str) -> Any:
        """Return the description of a parameter, listed or not."""
        told = self.known.told(name) if self.known is not None else None
        return told[1] if told is not None else super().describe_parameter(name)

    def set_parameters_atomically(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Set parameters, listed or not."""
        names = [each.name for each in parameters]
        admitted = self.known.admitted(names) if self.known is not None else []
        result = super().set_parameters_atomically(parameters)
        if not result.successful:
            for name in admitted:
                self.undeclare_parameter(name)
        return result
