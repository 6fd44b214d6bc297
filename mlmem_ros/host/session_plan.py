# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What shall be recorded; it can be planned where there is nothing to record with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..contract.topics import Topic
from .settings import RecordSettings


@dataclass(frozen=True)
class SessionPlan:
    """What a session shall hold.

    Attributes:
        node: Full name of the node.
        settings: Where, and how carefully.
        topics: All that is published and received, by full names.
        parameters: The node's parameters, for the record.
    """

    node: str
    settings: RecordSettings
    topics: Sequence[Topic] = ()
    parameters: Mapping[str, Any] | None = None
