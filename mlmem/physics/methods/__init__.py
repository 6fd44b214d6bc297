# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Methods that step a chain in time, one per file, each with its loop."""

from .integrator import Integrator
from .noh_bathe import NOH_BATHE
from .pefrl import PEFRL

INTEGRATORS: dict[str, Integrator] = {each.name: each for each in (NOH_BATHE, PEFRL)}
"""The methods by name."""

DEFAULT_INTEGRATOR: Integrator = PEFRL
"""What steps a chain, `simulate` and an instrument that name none. Undamped it loses no energy,
and waves keep their amplitude: the only damping of an echo is the material's. At its step of 0.25
the method of Noh and Bathe damps the carrier by a third of eta. The figures of the paper name it,
because the paper used it; both evaluate the forces eight times a time unit.
"""

__all__ = ['DEFAULT_INTEGRATOR', 'INTEGRATORS', 'NOH_BATHE', 'PEFRL', 'Integrator']
