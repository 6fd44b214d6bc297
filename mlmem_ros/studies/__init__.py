# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is drawn and measured with the material and the device: figures and studies."""
