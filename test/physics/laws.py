# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""On-site laws as tests need them: curves of a few forces, and the force of the loops."""

import numpy as np

from mlmem.physics.curve import Curve
from mlmem.physics.formulas import on_site_factors
from mlmem.physics.jit import compile_kernel


def sample_force(force, low, high, number=256):
    """Return the curve of a force's values at a number of configurations, from low to high."""
    return Curve(low, high, tuple(force(np.linspace(low, high, number)).tolist()))


@compile_kernel
def on_site_force(constants, y):
    """Return the on-site force as the loops compute it, shape (m,), of a cell without scatter."""
    found = np.empty_like(y)
    for k in range(len(y)):
        slope, factor = on_site_factors(constants, 1, y[k])
        found[k] = slope * factor
    return found
