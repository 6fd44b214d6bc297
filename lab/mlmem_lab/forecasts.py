# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The values of every finding of the design check, for the pages."""

from __future__ import annotations

from typing import Any

from mlmem import load_element
from mlmem_tools.checks import check

from .study import Study


def forecast_preset(name: str) -> dict[str, Any]:
    """Return what the check of a shipped element finds, by name."""
    return {
        found.name: found.values
        for found in check(*load_element(name).design_and_settings).findings
    }


forecasts_study = Study(
    'forecasts',
    forecast_preset,
    ('case_2',),
    (
        'lab/mlmem_lab/forecasts.py',
        'mlmem_tools/checks',
        'mlmem_tools/identification/kick_search.py',
    ),
)
