# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sweeps of which the default suite runs a sample, and `make test-slow` all."""

import pytest


def sampled(values, kept):
    """Return the parameters of a sweep; those for which `kept` is false are slow."""
    rows = [(value, value if isinstance(value, tuple) else (value,)) for value in values]
    return [
        value if kept(value) else pytest.param(*row, marks=pytest.mark.slow) for value, row in rows
    ]
