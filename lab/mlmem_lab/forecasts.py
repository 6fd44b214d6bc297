# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the design check forecasts, for the pages.

python3 -m mlmem_lab.forecasts [PRESET ...] makes lab/results/forecasts.json: the values of every
finding, by preset.
"""

from __future__ import annotations

import sys
from typing import Any

from mlmem import preset
from mlmem_tools.checks import check

from .results import run


def forecast_preset(name: str) -> dict[str, Any]:
    """Return what the check of a preset finds, by name."""
    return {found.name: found.values for found in check(*preset(name)).findings}


if __name__ == '__main__':
    sys.exit(run('forecasts', __doc__, forecast_preset, modules=['mlmem_tools/checks']))
