# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Methods that step a chain in time, one per file, each with its loop."""

from .integrator import Integrator
from .noh_bathe import NOH_BATHE
from .pefrl import PEFRL

INTEGRATORS: dict[str, Integrator] = {each.name: each for each in (NOH_BATHE, PEFRL)}
"""The methods by name."""

__all__ = ['INTEGRATORS', 'NOH_BATHE', 'PEFRL', 'Integrator']
