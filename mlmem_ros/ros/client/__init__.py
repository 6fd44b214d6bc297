# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot's side of the contract: clients, banks, monitors. No device and no node here."""

from .client import MemoryClient as MemoryClient
