# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a conversation with a memory node goes through: the line to it, and calls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node


@dataclass(frozen=True)
class Call:
    """One service call: the client it goes through, and the request.

    A request that is None is not sent: it stands for the wait until the service is there.
    """

    client: Any
    request: Any = None

    def take(self) -> None:
        """Give those who asked the responses that have come in, as an executor does."""
        while True:
            try:
                with self.client.handle:
                    kind = self.client.srv_type.Response
                    header, response = self.client.handle.take_response(kind)
            except InvalidHandle:  # destroyed meanwhile, as when ROS is shut down
                return
            if header is None:
                return
            try:
                asked = self.client.get_pending_request(header.request_id.sequence_number)
            except KeyError:  # it has been given up
                continue
            asked.set_result(response)


@dataclass(frozen=True)
class Line:
    """How a conversation reaches its peer.

    Attributes:
        node: The robot's node.
        group: Callback group of all that the conversation needs of the executor.
        peer: Full name of the memory node, for messages.
        patience: Seconds that a service may take to appear.
    """

    node: Node
    group: CallbackGroup
    peer: str
    patience: float
