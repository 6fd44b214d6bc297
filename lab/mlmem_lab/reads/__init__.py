# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads in a row, counted over everything that ships or can be designed, whole or broken."""
