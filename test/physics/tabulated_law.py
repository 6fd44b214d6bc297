# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""On-site laws of a few forces, so that a test knows between which of them the spline runs."""

import numpy as np

from mlmem.physics.curve import Curve


def sample_force(force, low, high, number=256):
    """Return the curve of a force's values at a number of configurations, from low to high."""
    return Curve(low, high, tuple(force(np.linspace(low, high, number)).tolist()))
