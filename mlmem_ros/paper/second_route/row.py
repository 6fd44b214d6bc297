# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One line of the table of differences."""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """One quantity by two routes."""

    quantity: str
    ours: float
    theirs: float
    route: str
