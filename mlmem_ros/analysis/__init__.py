# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What judges a design, and sees the true wall: checks, forecasts, landscapes, the designer.

It knows the device, and no device knows it: what a procedure does must follow from what the ends
tell. No real time, no ROS.
"""
