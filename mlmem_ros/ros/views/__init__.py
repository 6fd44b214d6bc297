# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is made for people to look at: images and markers of a device. No topic is known here."""
