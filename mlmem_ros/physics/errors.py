# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the material."""


class DesignError(ValueError):
    """A design that is not a mechanical memory: the message names symbol, value and bound."""


class StateError(ValueError):
    """Arrays that are not a state of this chain: wrong shape, not finite, wrong kind."""
