# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The element in a browser: a page, its server, and their messages; no physics here."""
