# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every quantity once more, by a route that shares no code with the first."""

from __future__ import annotations

from typing import NamedTuple


class TwoWays(NamedTuple):
    """One quantity by two routes."""

    quantity: str
    ours: float
    theirs: float
    route: str
