# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The values of streams as messages, by the type of the message, and those of a self-test."""

from __future__ import annotations

import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from std_msgs.msg import MultiArrayDimension, MultiArrayLayout

from mlmem import Array, Outcome

from .answers import format_values
from .streams import Stream
from .topics import ERROR, OK, Status


@dataclass(frozen=True)
class Publication:
    """What a message says besides its values.

    Attributes:
        node: The node's full name.
        frame_id: The frame of stamped messages.
        now: Returns the time of stamped messages.
    """

    node: str
    frame_id: str
    now: Callable[[], Time]


def build_message(stream: Stream, values: Any, publication: Publication) -> Any:
    """Return the message of a stream with its values: a `Status`, an array, a mapping of fields
    other than the header, or what is in the only field, `data`.
    """
    if isinstance(values, Status):
        return build_status(values, publication.node)
    if stream.dimensions:
        return _build_array(stream, values)
    message = stream.kind(**values if isinstance(values, Mapping) else {'data': values})
    if hasattr(message, 'header'):
        message.header.stamp = publication.now()
        message.header.frame_id = publication.frame_id
    return message


def build_status(status: Status, node: str, component: str = '') -> DiagnosticStatus:
    """Return a status of the node of this full name, or of one of its components."""
    texts = format_values(status.values)
    return DiagnosticStatus(
        level=bytes([status.severity]),
        name=f'{node[1:]}: {component}' if component else node.rpartition('/')[2],
        message=status.text,
        hardware_id=node,
        values=[KeyValue(key=key, value=value) for key, value in texts.items()],
    )


def _build_array(stream: Stream, values: Array) -> Any:
    """Return an array with its layout, in the only type that rclpy does not check by element."""
    sizes = [size for _, size in stream.dimensions]
    shape = values.reshape(-1)[stream.offset :].reshape(sizes).shape
    dimensions: list[MultiArrayDimension] = []
    stride = 1
    for (label, _), size in reversed(list(zip(stream.dimensions, shape, strict=True))):
        stride *= size
        dimensions.insert(0, MultiArrayDimension(label=label, size=size, stride=stride))
    single = 'Float32' in stream.type
    data = array.array('f' if single else 'd')
    data.frombytes(values.astype(np.float32 if single else np.float64).tobytes())
    layout = MultiArrayLayout(dim=dimensions, data_offset=stream.offset)
    return stream.kind(layout=layout, data=data)


def build_test_statuses(outcome: Outcome, node: str) -> list[DiagnosticStatus]:
    """Return one status for every check of a self-test, or a single one without checks."""
    return [
        build_status(
            Status(OK if check.passed else ERROR, check.message, check.values), node, check.name
        )
        for check in outcome.checks
    ] or [build_status(Status(ERROR, outcome.error), node, 'self_test')]
