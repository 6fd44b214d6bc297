# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What touches an element: driver, actuator, transducers, base, sensors and faults."""
