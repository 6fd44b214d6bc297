# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Everything that judges a design or sees the true wall: checks, forecasts, landscapes, designer.

It imports the device, never the reverse: a procedure may use only what is measured at the ends. No
real time, no ROS.
"""
