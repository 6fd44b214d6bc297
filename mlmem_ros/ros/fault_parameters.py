# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters `faults.*`: what is set goes to the device at once, as a command."""

from __future__ import annotations

import dataclasses

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..device import Faults, Loop, MemoryElement, Refused, SetFaults, SettingsError
from .gate import Gate

PREFIX = 'faults.'


class FaultParameters:
    """Keeps the faults of the device those of the parameters.

    Attributes:
        element: The device whose faults they are, or None while there is none: a value that it
            could not have is refused.
    """

    def __init__(self, node: Node, gate: Gate) -> None:
        self.element: MemoryElement | None = None
        self._node = node
        self._gate = gate
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._submit)

    def begin(self, loop: Loop) -> None:
        """Hand the faults to a device whose time is about to run, where it has others."""
        faults = self._with(())
        if faults != loop.element.faults:
            loop.submit(SetFaults(faults))

    def _with(self, changed: tuple[Parameter, ...] | list[Parameter]) -> Faults:
        values = {
            field.name: self._node.get_parameter(PREFIX + field.name).value
            for field in dataclasses.fields(Faults)
        }
        return Faults(**values | {one.name.removeprefix(PREFIX): one.value for one in changed})

    def _check(self, changed: list[Parameter]) -> SetParametersResult:
        ours = [parameter for parameter in changed if parameter.name.startswith(PREFIX)]
        if ours and self.element is not None:
            try:
                self.element.specimen(self._with(ours))
            except (Refused, SettingsError) as refusal:
                return SetParametersResult(successful=False, reason=str(refusal))
        return SetParametersResult(successful=True)

    def _submit(self, changed: list[Parameter]) -> None:
        ours = any(parameter.name.startswith(PREFIX) for parameter in changed)
        if ours and self._gate.loop is not None:
            self._gate.submit(SetFaults(self._with(())))
