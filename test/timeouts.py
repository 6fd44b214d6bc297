# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long a test waits for what must happen. No test asserts that anything is fast."""

TIMEOUT_S = 90.0
"""Seconds to wait for any event: on a loaded machine a node takes long to start."""
