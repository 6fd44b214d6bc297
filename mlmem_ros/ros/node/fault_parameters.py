# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters `faults.*`: what is set goes to the device at once, as a command."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from ...device import Faults, Refused, SettingsError
from ...host import Host
from .boundary import Boundary

PREFIX = 'faults.'


class FaultParameters:
    """Keeps the device's faults equal to the parameters; impossible ones are refused."""

    def __init__(self, node: Node, host: Host, boundary: Boundary) -> None:
        self._node = node
        self._host = host
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(boundary.guarded('faults', self._submit))

    def _with(self, changed: Sequence[Parameter]) -> Faults:
        values = {
            field.name: self._node.get_parameter(PREFIX + field.name).value
            for field in dataclasses.fields(Faults)
        }
        return Faults(**values | {one.name.removeprefix(PREFIX): one.value for one in changed})

    def _check(self, changed: list[Parameter]) -> SetParametersResult:
        ours = [parameter for parameter in changed if parameter.name.startswith(PREFIX)]
        element = self._host.element
        if ours and element is not None:
            try:
                element.specimen(self._with(ours))
            except (Refused, SettingsError) as refusal:
                return SetParametersResult(successful=False, reason=str(refusal))
        return SetParametersResult(successful=True)

    def _submit(self, changed: list[Parameter]) -> None:
        if any(parameter.name.startswith(PREFIX) for parameter in changed):
            self._host.be_faulty(self._with(()))
