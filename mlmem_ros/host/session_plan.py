# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What to record; a plan needs no recording packages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..contract.topics import Topic
from .settings import RecordSettings


@dataclass(frozen=True)
class SessionPlan:
    """What a session records.

    Attributes:
        node: Full name of the node.
        settings: Where and how.
        topics: All published and subscribed topics, by full name.
        parameters: The node's parameters, for the record.
    """

    node: str
    settings: RecordSettings
    topics: Sequence[Topic] = ()
    parameters: Mapping[str, Any] | None = None
