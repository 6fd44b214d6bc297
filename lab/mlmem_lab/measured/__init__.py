# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Transition waves measured in a lattice of bistable shells, and our predictions of them.

Units are those of the data: g, cm, ms; so forces are in 10 N and energies in 0.1 J. Speeds are
in m/s.
"""
