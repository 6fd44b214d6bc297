# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the design check forecasts, for the pages: python3 -m mlmem_lab.forecasts PRESET ...

Makes lab/results/forecasts.json: the values of every finding, by preset.
"""

from __future__ import annotations

import sys

from mlmem_ros.device import preset
from mlmem_tools.checks import check

from .results import FOLDER, save


def main(names: list[str]) -> int:
    """Check presets by name, and save what is found."""
    presets = {
        name: {found.name: found.values for found in check(*preset(name)).findings}
        for name in names
    }
    made = f'python3 -m mlmem_lab.forecasts {" ".join(names)}'
    save(FOLDER / 'forecasts.json', {'presets': presets}, made, of=names)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
