# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The line to a memory node, and the calls made over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node


@dataclass(frozen=True)
class Call:
    """One service call: an rclpy client, and the request.

    Without a request it only waits until the service is available.
    """

    client: Any
    request: Any = None

    def take(self) -> None:
        """Deliver the responses that have arrived, as an executor does."""
        while True:
            try:
                with self.client.handle:
                    kind = self.client.srv_type.Response
                    header, response = self.client.handle.take_response(kind)
            except InvalidHandle:  # destroyed meanwhile, for example by a shutdown of ROS
                return
            if header is None:
                return
            try:
                asked = self.client.get_pending_request(header.request_id.sequence_number)
            except KeyError:  # it was given up
                continue
            asked.set_result(response)


@dataclass(frozen=True)
class Connection:
    """How a conversation reaches a memory node.

    Attributes:
        node: The robot's node.
        group: Callback group of all that the conversation runs in the executor.
        peer: Full name of the memory node, for messages.
        patience: Seconds to wait for a service to appear.
    """

    node: Node
    group: CallbackGroup
    peer: str
    patience: float
