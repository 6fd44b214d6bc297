# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What people use around a memory: the command line, a page in the browser, checks, twin, bank.

It imports `mlmem_ros`, which reaches it through entry points alone (`mlmem_ros.packages`).
"""
